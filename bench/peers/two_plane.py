"""Wei and Ma's two-plane calibration (CVPR 1991): lines of sight without a camera model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from spinewatch.arrays import Float
from spinewatch.calibration.points import ImagePoints


@dataclass(frozen=True, eq=False)
class TwoPlane:
    """A map of image points to the points in which their lines of sight intersect the planes z = low and z = high."""

    homographies: Float
    K1: float
    planes_mm: tuple[float, float]
    centre_px: Float
    scale_px: float

    def intersect(self, pixels: Float) -> tuple[Float, Float]:
        """Return the intersections (n, 3) with both planes."""
        return _intersect(
            self.homographies, self.K1, (pixels - self.centre_px) / self.scale_px, self.planes_mm
        )


def two_plane(points: ImagePoints) -> TwoPlane:
    """Return the map of a field of any heights: pegs between the planes are interpolated along the line of sight.

    Each plane has a homography (8 constants), both share one radial term; a control point at height z lies at the
    fraction (z - low) / (high - low) of its line. Linear first, then adjusted in object space.
    """
    X = points.control_mm
    low, high = float(X[:, 2].min()), float(X[:, 2].max())
    fraction = (X[:, 2] - low) / (high - low)
    centre = points.pixels.mean(axis=0)
    scale = float(np.abs(points.pixels - centre).max())
    uv = (points.pixels - centre) / scale
    affine = np.column_stack([uv, np.ones(len(uv))])
    A = np.column_stack([affine * (1 - fraction)[:, None], affine * fraction[:, None]])
    linear = np.linalg.lstsq(A, X[:, :2], rcond=None)[0]
    initial = np.zeros((2, 3, 3))
    initial[:, :2] = np.stack([linear[:3].T, linear[3:].T])
    initial[:, 2, 2] = 1

    def unpack(v: Float) -> tuple[Float, float]:
        return np.concatenate([v[:16].reshape(2, 8), np.ones((2, 1))], axis=1).reshape(2, 3, 3), float(v[16])

    def residuals(v: Float) -> Float:
        a, b = _intersect(*unpack(v), uv, (low, high))
        return np.asarray((a + fraction[:, None] * (b - a) - X)[:, :2].ravel())

    v = least_squares(residuals, np.append(initial.reshape(2, 9)[:, :8].ravel(), 0.0), x_scale="jac").x
    H, K1 = unpack(v)
    return TwoPlane(H, K1, (low, high), centre, scale)


def intersect_lines(left: TwoPlane, right: TwoPlane, left_px: Float, right_px: Float) -> Float:
    """Return the points (n, 3) midway between the lines of sight."""
    a, b = left.intersect(left_px)
    c, d = right.intersect(right_px)
    p, q = (
        (b - a) / np.linalg.norm(b - a, axis=1, keepdims=True),
        (d - c) / np.linalg.norm(d - c, axis=1, keepdims=True),
    )
    N = 2 * np.eye(3) - p[:, :, None] * p[:, None] - q[:, :, None] * q[:, None]
    rhs = a - (a * p).sum(1, keepdims=True) * p + c - (c * q).sum(1, keepdims=True) * q
    return np.asarray(np.linalg.solve(N, rhs[..., None])[..., 0])


def _intersect(H: Float, K1: float, uv: Float, planes: tuple[float, float]) -> tuple[Float, Float]:
    straight = uv * (1 + K1 * (uv**2).sum(axis=1, keepdims=True))
    image = np.column_stack([straight, np.ones(len(uv))])
    out = []
    for plane, z in zip(H, planes, strict=True):
        w = image @ plane.T
        out.append(np.column_stack([w[:, :2] / w[:, 2:], np.full(len(uv), z)]))
    return out[0], out[1]
