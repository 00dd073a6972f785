"""Rigid and similarity transforms, their least-squares fit to points, and its covariance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.errors import SpinewatchError
from spinewatch.geometry.rotations import cross_matrix

_MIN_EXTENT = 1e-9
"""Points on a line: their second principal extent is below this fraction of the first."""


class DegeneratePointsError(SpinewatchError):
    """Points coincide or lie on one line, so that they determine no rotation."""

    code = "degenerate-points"


@dataclass(frozen=True, eq=False)
class RigidTransform:
    """A rigid motion ``X -> R X + t``.

    Attributes
    ----------
    rotation
        R, shape (3, 3).
    translation_mm
        t, shape (3,), mm.
    """

    rotation: Float
    translation_mm: Float

    @classmethod
    def identity(cls) -> RigidTransform:
        """Return the motion that moves nothing.

        Returns
        -------
        RigidTransform
            R = I, t = 0.
        """
        return cls(np.eye(3), np.zeros(3))

    def __call__(self, points_mm: Float) -> Float:
        """Return the moved points.

        Parameters
        ----------
        points_mm
            Points, shape (n, 3), mm.

        Returns
        -------
        Float
            R X + t of each, shape (n, 3), mm.
        """
        return np.asarray(points_mm @ self.rotation.T + self.translation_mm)

    def inverse(self) -> RigidTransform:
        """Return the inverse motion.

        Returns
        -------
        RigidTransform
            ``X -> R^T (X - t)``.
        """
        return RigidTransform(self.rotation.T, -self.rotation.T @ self.translation_mm)

    def __matmul__(self, first: RigidTransform) -> RigidTransform:
        """Return the composition that applies ``first`` and then this motion."""
        return RigidTransform(self.rotation @ first.rotation, self(first.translation_mm[None])[0])


@dataclass(frozen=True, eq=False)
class SimilarityTransform:
    """A similarity ``X -> s R X + t``, the seven-parameter transform.

    Attributes
    ----------
    scale
        s, without unit.
    rotation
        R, shape (3, 3).
    translation_mm
        t, shape (3,), mm.
    """

    scale: float
    rotation: Float
    translation_mm: Float

    def __call__(self, points_mm: Float) -> Float:
        """Return the transformed points.

        Parameters
        ----------
        points_mm
            Points, shape (n, 3), mm.

        Returns
        -------
        Float
            s R X + t of each, shape (n, 3), mm.
        """
        return np.asarray(self.scale * points_mm @ self.rotation.T + self.translation_mm)


def fit_rigid(source_mm: Float, target_mm: Float) -> RigidTransform:
    """Return the rigid motion that brings points nearest to others: absolute orientation.

    Parameters
    ----------
    source_mm, target_mm
        Corresponding points, shape (n, 3), mm; at least three, not on one line.

    Returns
    -------
    RigidTransform
        The least-squares motion from source to target, of determinant +1 also for points in a plane.

    Raises
    ------
    DegeneratePointsError
        If either set of points lies on one line.

    References
    ----------
    W. Kabsch, Acta Cryst. A32 (1976) 922; S. Umeyama, IEEE PAMI 13 (1991) 376, with scale 1.

    Examples
    --------
    >>> import numpy as np
    >>> points = np.array([[0.0, 0, 0], [10, 0, 0], [0, 20, 0]])
    >>> fit_rigid(points, points + [1.0, 2.0, 3.0]).translation_mm.round(9)
    array([1., 2., 3.])
    """
    R, _ = _fitted_rotation(source_mm, target_mm)
    return RigidTransform(R, target_mm.mean(axis=0) - R @ source_mm.mean(axis=0))


def fit_similarity(source_mm: Float, target_mm: Float) -> SimilarityTransform:
    """Return the similarity that brings points nearest to others: the seven-parameter transform.

    Parameters
    ----------
    source_mm, target_mm
        Corresponding points, shape (n, 3), mm; at least three, not on one line.

    Returns
    -------
    SimilarityTransform
        The least-squares similarity from source to target, without reflection.

    Raises
    ------
    DegeneratePointsError
        If either set of points lies on one line.

    References
    ----------
    S. Umeyama, IEEE PAMI 13 (1991) 376, eqs 39-42.

    Examples
    --------
    >>> import numpy as np
    >>> points = np.array([[0.0, 0, 0], [10, 0, 0], [0, 20, 0]])
    >>> round(fit_similarity(points, 1.05 * points).scale, 9)
    1.05
    """
    R, gain = _fitted_rotation(source_mm, target_mm)
    centred = source_mm - source_mm.mean(axis=0)
    scale = gain / float((centred**2).sum())
    return SimilarityTransform(scale, R, target_mm.mean(axis=0) - scale * R @ source_mm.mean(axis=0))


def rigid_covariance(origin_mm: Float, points_mm: Float, covariances_mm2: Float) -> Float:
    """Return the covariance of a pose found by `fit_rigid` from a model to measured points.

    First order: with r from the centroid and K = sum(|r|^2 I - r r^T), the rotation vector is
    ``K^-1 sum [r]x e`` and the origin ``mean(e) - [origin - centroid]x theta``.

    Parameters
    ----------
    origin_mm
        Where the model's origin came to lie, shape (3,), mm.
    points_mm
        Measured points, shape (n, 3), mm.
    covariances_mm2
        Their covariances, shape (n, 3, 3), mm^2, independent of each other.

    Returns
    -------
    Float
        Covariance of the origin (mm) and of a small rotation vector about the axes of the measured points
        (degrees), shape (6, 6).

    References
    ----------
    K. Kanatani, Geometric Computation for Machine Vision (1993), ch. 5; docs/method.md.
    """
    n = len(points_mm)
    centre = points_mm.mean(axis=0)
    r = points_mm - centre
    K = (r * r).sum() * np.eye(3) - r.T @ r
    to_rotation = np.linalg.solve(K, cross_matrix(r))  # (n, 3, 3)
    to_origin = np.eye(3) / n - cross_matrix(origin_mm - centre) @ to_rotation
    J = np.concatenate([to_origin, np.degrees(to_rotation)], axis=1)
    return np.asarray((J @ covariances_mm2 @ np.swapaxes(J, -1, -2)).sum(axis=0))


def approximate_poses(model_mm: Float, points_mm: Float) -> tuple[Float, Float]:
    """Return rigid motions from a model to measured points, from three points and not of best fit.

    The cheap form for rating candidates and for initial values: the axes come from the first three points, the
    origin from the mean of all.

    Parameters
    ----------
    model_mm
        Model points, shape (n, 3), mm.
    points_mm
        Measured points, shape (..., n, 3), mm.

    Returns
    -------
    origin_mm : Float
        Where the model's origin comes to lie, shape (..., 3), mm.
    rotation : Float
        Rotations, shape (..., 3, 3). For a flat triad the third column is the thesis's orientation,
        (b0 - b2) x (b0 - b1) of unit length (fig. 5.7).
    """
    R = _three_point_axes(points_mm) @ _three_point_axes(model_mm).T
    origin = points_mm.mean(axis=-2) - R @ model_mm.mean(axis=0)
    return np.asarray(origin), np.asarray(R)


def _fitted_rotation(source_mm: Float, target_mm: Float) -> tuple[Float, float]:
    """Return the rotation (3, 3) of least squares and tr(D S) of Umeyama's eq. 42 times n."""
    a, b = source_mm - source_mm.mean(axis=0), target_mm - target_mm.mean(axis=0)
    U, s, Vt = np.linalg.svd(b.T @ a)
    if s[1] <= _MIN_EXTENT * max(float(s[0]), np.finfo(np.float64).tiny):
        raise DegeneratePointsError(
            "the points lie on one line or coincide, which determines no rotation; give three that do not"
        )
    sign = np.array([1, 1, np.linalg.det(U @ Vt)])
    return np.asarray(U @ np.diag(sign) @ Vt), float(s @ sign)


def _three_point_axes(points_mm: Float) -> Float:
    x, across = (points_mm[..., 0, :] - points_mm[..., k, :] for k in (2, 1))
    z = np.cross(x, across)
    x, z = (v / np.linalg.norm(v, axis=-1, keepdims=True) for v in (x, z))
    return np.stack([x, np.cross(z, x), z], axis=-1)
