"""Space intersection: the object points in which rays of two or more cameras meet (section 5.5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.camera import Camera, Float
from spinewatch.correspondence.rays import Rays

_STEPS = 10
_TOLERANCE_MM = 1e-10


@dataclass(frozen=True, eq=False)
class Intersection:
    """n intersected points.

    ``position_mm`` (n, 3); ``covariance_mm2`` (n, 3, 3), propagated from the features' covariance;
    ``parallax_mm`` (n,), for two rays the distance by which they miss each other; ``chi2`` (n,) of the image
    residuals, with 2k - 3 degrees of freedom for k rays.
    """

    position_mm: Float
    covariance_mm2: Float
    parallax_mm: Float
    chi2: Float


def midpoint(rays: Sequence[Rays]) -> tuple[Float, Float]:
    """Return the points (n, 3) nearest to k rays each, and twice their RMS distance (n,) from those rays, mm.

    For two rays this is the middle of the parallax vector and its length (eq. 5.15). Parallel rays give NaN.
    """
    centres = np.stack([r.camera.centre for r in rays])
    d = np.stack([r.vectors for r in rays], axis=1)
    d = d / np.linalg.norm(d, axis=-1, keepdims=True)
    across = np.eye(3) - d[..., :, None] * d[..., None, :]
    A = across.sum(axis=1)
    b = (across @ centres[:, :, None])[..., 0].sum(axis=1)
    parallel = np.linalg.det(A) < 1e-12
    A[parallel] = np.eye(3)
    X = np.linalg.solve(A, b[..., None])[..., 0]
    X[parallel] = np.nan
    miss = (across @ (X[:, None, :] - centres)[..., None])[..., 0]
    return X, 2 * np.sqrt((miss**2).sum(axis=-1).mean(axis=1))


def intersect(rays: Sequence[Rays]) -> Intersection:
    """Return the points of greatest likelihood in which the i-th rays of k cameras meet.

    Gauss-Newton on the collinearity equations 3.4, weighted by the features' covariance, from the midpoint.
    The residuals are taken on the undistorted plate, which differs from pixels only by second-order terms.
    """
    X, parallax = midpoint(rays)
    weights = [np.linalg.inv(r.covariance_mm2) for r in rays]
    N = np.broadcast_to(np.eye(3), (len(X), 3, 3))
    for _ in range(_STEPS):
        N = np.zeros((len(X), 3, 3))
        b = np.zeros((len(X), 3, 1))
        for r, W in zip(rays, weights, strict=True):
            predicted, J = plate_projection(r.camera, X)
            JtW = np.swapaxes(J, -1, -2) @ W
            N += JtW @ J
            b += JtW @ (r.ideal_mm - predicted)[..., None]
        step = np.linalg.solve(N, b)[..., 0]
        X = X + step
        if not np.any(np.abs(step) > _TOLERANCE_MM):
            break
    chi2 = np.zeros(len(X))
    for r, W in zip(rays, weights, strict=True):
        miss = r.ideal_mm - plate_projection(r.camera, X)[0]
        chi2 += np.einsum("ni,nij,nj->n", miss, W, miss)
    return Intersection(X, np.asarray(np.linalg.inv(N), dtype=np.float64), parallax, chi2)


def plate_projection(camera: Camera, points_mm: Float) -> tuple[Float, Float]:
    """Return undistorted plate offsets (..., 2), mm, of points (..., 3), and the derivatives (..., 2, 3)."""
    Xc = (points_mm - camera.centre) @ camera.M.T
    scale = -camera.focal_length_mm / Xc[..., 2]
    ideal = scale[..., None] * Xc[..., :2]
    J = scale[..., None, None] * camera.M[:2] - (ideal / Xc[..., 2:])[..., None] * camera.M[2]
    return ideal, J
