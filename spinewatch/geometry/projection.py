"""Central projection: the ideal pinhole camera that remains once pixels and lens distortion are removed."""

from __future__ import annotations

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
