"""Central projection: the ideal pinhole camera that remains once pixels and lens distortion are removed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Bool, Float


@dataclass(frozen=True, eq=False)
class Pinhole:
    """A central projection onto the undistorted image plane.

    Points in view have ``Xc[2] < 0`` in camera space, ``Xc = M (X - centre)``.

    Attributes
    ----------
    centre_mm
        Perspective centre, shape (3,), object space, mm.
    M
        Rotation from object axes to camera axes, shape (3, 3).
    focal_length_mm
        Distance of the image plane from the centre, mm.
    """

    centre_mm: Float
    M: Float
    focal_length_mm: float

    def project(self, points_mm: Float) -> tuple[Float, Float]:
        """Return the images of points and their derivatives.

        Parameters
        ----------
        points_mm
            Points, shape (..., 3), object space, mm.

        Returns
        -------
        ideal_mm : Float
            Undistorted offsets from the principal point, shape (..., 2), mm: the right side of eq. 3.4.
        jacobian : Float
            d(ideal)/d(point), shape (..., 2, 3), mm per mm.
        """
        Xc = (points_mm - self.centre_mm) @ self.M.T
        scale = -self.focal_length_mm / Xc[..., 2]
        ideal = scale[..., None] * Xc[..., :2]
        J = scale[..., None, None] * self.M[:2] - (ideal / Xc[..., 2:])[..., None] * self.M[2]
        return ideal, J

    def in_front(self, points_mm: Float) -> Bool:
        """Return whether points lie in front of the camera.

        Parameters
        ----------
        points_mm
            Points, shape (..., 3), object space, mm.

        Returns
        -------
        Bool
            Whether ``Xc[2] < 0``, shape (...).
        """
        return np.asarray((points_mm - self.centre_mm) @ self.M[2] < 0)

    def rays(self, ideal_mm: Float) -> Float:
        """Return the rays through image points.

        Parameters
        ----------
        ideal_mm
            Undistorted offsets from the principal point, shape (..., 2), mm.

        Returns
        -------
        Float
            Vectors ``M^T (x, y, -f)`` from the centre to the image plane, shape (..., 3), object axes, mm.

        References
        ----------
        Thesis eq. 3.2.
        """
        f = np.full((*ideal_mm.shape[:-1], 1), -self.focal_length_mm)
        return np.concatenate([ideal_mm, f], axis=-1) @ self.M


@dataclass(frozen=True, eq=False)
class PinholeStack:
    """k central projections of the same points, with the points along the last axis.

    Attributes
    ----------
    centre_mm
        Perspective centres, shape (k, 3, 1), object space, mm.
    M
        Rotations from object axes to camera axes, shape (k, 3, 3).
    focal_length_mm
        Distances of the image planes from the centres, shape (k, 1, 1), mm.
    """

    centre_mm: Float
    M: Float
    focal_length_mm: Float

    @classmethod
    def of(cls, pinholes: Sequence[Pinhole]) -> PinholeStack:
        """Return several central projections as one.

        Parameters
        ----------
        pinholes
            k central projections.

        Returns
        -------
        PinholeStack
            All of them, in their order.
        """
        return cls(
            np.array([pinhole.centre_mm for pinhole in pinholes])[..., None],
            np.array([pinhole.M for pinhole in pinholes]),
            np.array([pinhole.focal_length_mm for pinhole in pinholes])[:, None, None],
        )

    def project(self, points_mm: Float) -> tuple[Float, Float]:
        """Return the images of points and their derivatives, as `Pinhole.project`.

        Parameters
        ----------
        points_mm
            Points, shape (3, n), object space, mm.

        Returns
        -------
        ideal_mm : Float
            Undistorted offsets from the principal points, shape (k, 2, n), mm.
        jacobian : Float
            d(ideal)/d(point), shape (k, 2, 3, n), mm per mm.
        """
        ideal, scale = self._project(points_mm)
        along = (ideal / self.focal_length_mm)[:, :, None] * self.M[:, None, 2, :, None]
        return ideal, scale[:, None] * (self.M[:, :2, :, None] + along)

    def ideal(self, points_mm: Float) -> Float:
        """Return the images of points alone.

        Parameters
        ----------
        points_mm
            Points, shape (3, n), object space, mm.

        Returns
        -------
        Float
            Undistorted offsets from the principal points, shape (k, 2, n), mm.
        """
        return self._project(points_mm)[0]

    def _project(self, points_mm: Float) -> tuple[Float, Float]:
        """Return the images (k, 2, n) of points (3, n), and the scale (k, 1, n) of the images there."""
        Xc = self.M @ (points_mm - self.centre_mm)
        scale = -self.focal_length_mm / Xc[:, 2:]
        return scale * Xc[:, :2], scale
