"""Rays of image points, and the points in which lines in space come nearest to each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.geometry.projection import Pinhole
from spinewatch.geometry.small_matrices import inverse_3x3

_PARALLEL = 1e-12
"""Determinant below which the squared distances from unit rays determine no point."""


@dataclass(frozen=True, eq=False)
class Rays:
    """Rays of n image points of one camera.

    On the undistorted image plane epipolar lines are straight and rays are linear, whatever the lens.

    Attributes
    ----------
    pinhole
        The camera's central projection.
    ideal_mm
        Undistorted offsets from the principal point, shape (n, 2), mm.
    covariance_mm2
        Covariances of those, shape (n, 2, 2), mm^2.
    vectors
        Vectors from the centre to the image plane, shape (n, 3), object axes, mm.
    """

    pinhole: Pinhole
    ideal_mm: Float
    covariance_mm2: Float
    vectors: Float

    def __len__(self) -> int:
        return len(self.ideal_mm)

    def take(self, index: object) -> Rays:
        """Return a selection of the rays.

        Parameters
        ----------
        index
            Index or mask array.

        Returns
        -------
        Rays
            The selected rays, in the order of the index.
        """
        i = np.asarray(index)
        return Rays(self.pinhole, self.ideal_mm[i], self.covariance_mm2[i], self.vectors[i])


def nearest_points(rays: Sequence[Rays]) -> tuple[Float, Float]:
    """Return the points nearest to the i-th rays of k cameras.

    Parameters
    ----------
    rays
        Rays of each camera, n per camera.

    Returns
    -------
    position_mm : Float
        Points of least squared distance from their rays, shape (n, 3), mm; NaN for parallel rays. For two rays the
        midpoint of their common perpendicular.
    parallax_mm : Float
        Twice the RMS distance of a point from its rays, shape (n,), mm; for two rays the length of their common
        perpendicular.

    References
    ----------
    Thesis eq. 5.15.
    """
    centres = np.array([r.pinhole.centre_mm for r in rays])[..., None]
    d = np.ascontiguousarray(np.swapaxes([r.vectors for r in rays], 1, 2))
    d = d / np.sqrt((d * d).sum(axis=1, keepdims=True))
    A = len(rays) * np.eye(3)[..., None] - np.einsum("kin,kjn->ijn", d, d)
    inverse, determinant = inverse_3x3(A)
    X = np.einsum("ijn,jn->in", inverse, _across(centres, d).sum(axis=0))
    X[:, determinant < _PARALLEL] = np.nan
    distance = _across(X - centres, d)
    return np.ascontiguousarray(X.T), 2 * np.sqrt((distance * distance).sum(axis=1).mean(axis=0))


def axes_approach_mm(left: Pinhole, right: Pinhole) -> tuple[float, float] | None:
    """Return where two optical axes come nearest to each other.

    Parameters
    ----------
    left, right
        The two cameras.

    Returns
    -------
    tuple of float or None
        Distance of that point from each perspective centre along its axis, mm, positive in front of the camera;
        None for parallel axes.
    """
    axes = -np.stack([left.M[2], right.M[2]], axis=1)
    A = np.column_stack([axes[:, 0], -axes[:, 1]])
    along, _, rank, _ = np.linalg.lstsq(A, right.centre_mm - left.centre_mm, rcond=1e-6)
    return (float(along[0]), float(along[1])) if rank == 2 else None


def _across(vectors: Float, d: Float) -> Float:
    """Return the components of vectors (k, 3, n) across unit vectors (k, 3, n)."""
    return np.asarray(vectors - d * (d * vectors).sum(axis=1, keepdims=True))
