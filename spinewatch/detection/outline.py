"""The outline of a ball: a disc of known size, dark inside, fitted to the gray levels about a feature.

Centroids of correlation or darkness follow shading and reflections; the outline is where the ball ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

Float = NDArray[np.float64]
Single = NDArray[np.float32]

_RIDGE = np.float32(1e-6)


@dataclass(frozen=True)
class OutlineParameters:
    """Parameters of ``fit_outlines``.

    ``blur_px``: standard deviation of lens and pixel together. ``inner`` and ``outer``: the ring of pixels that counts,
    in radii; inside it lies the highlight, outside it other things. ``harmonics`` of the brightness around the ball.
    ``reach_px``: how far the centre may move from its start. ``robust_sigma``: residuals beyond lose weight.
    """

    blur_px: float = 0.6
    inner: float = 0.5
    outer: float = 1.2
    harmonics: int = 4
    iterations: int = 4
    reach_px: float = 1.2
    robust_sigma: float = 1.5


@dataclass(frozen=True, eq=False)
class Outlines:
    """Fitted outlines: centres (n, 2) in px with covariance (n, 2, 2), and the contrast (n,) of surroundings to ball.

    A fit that its ring does not determine has a NaN covariance.
    """

    xy_px: Float
    covariance_px2: Float
    contrast: Float


def fit_outlines(
    gray: NDArray[np.floating], start_px: Float, ball_px: tuple[float, float], parameters: OutlineParameters
) -> Outlines:
    """Return the outlines of balls of known (width, height) that start near pixels (n, 2) of an image (H, W).

    The model of a ring of pixels is ``inside (1 - s) + outside(angle) s`` with s the blurred step at the outline:
    the ball is evenly dark but for a linear shade, its surroundings any low harmonics of the angle. Gauss-Newton over
    centre and brightness together; the harmonics are shrunk by how much they vary over all balls of the image, so that
    plain surroundings cost no precision. The covariance is that of the residuals, weighted by their robust weights.
    """
    if len(start_px) == 0:
        return Outlines(np.empty((0, 2)), np.empty((0, 2, 2)), np.empty(0))
    p = parameters
    radii: Single = np.array([d / 2 for d in ball_px], dtype=np.float32)
    start = start_px.astype(np.float32)
    u, v, levels = _patches(gray, start, np.float32(p.outer) * radii + np.float32(p.reach_px))
    centre, robust = start, np.ones_like(levels)
    prior = np.full(6 + 2 * p.harmonics, 1e-6, dtype=np.float32)
    for _ in range(p.iterations):
        inside, outside, slope, ring = _ring(u - centre[:, :1], v - centre[:, 1:], radii, p)
        weight = ring * robust
        basis = np.concatenate([inside[0], outside[0]], axis=-1)
        brightness = _least_squares(basis, weight, levels, prior[2:])[0]
        residual = levels - _times(basis, brightness)
        edge = _times(outside[1], brightness[:, 3:]) - _times(inside[1], brightness[:, :3])
        jacobian = np.concatenate([slope * edge[..., None], basis], axis=-1)
        change, normal = _least_squares(jacobian, weight, residual, prior)
        variance = (weight * residual**2).sum(axis=1) / np.maximum(weight.sum(axis=1), 1)
        robust = 1 / (1 + residual**2 / (p.robust_sigma**2 * np.maximum(variance, 1e-3))[:, None])
        prior[6:] = np.median(variance) / np.maximum(np.median(brightness[:, 4:] ** 2, axis=0), 1e-3)
        centre = start + np.clip(centre + np.clip(change[:, :2], -0.5, 0.5) - start, -p.reach_px, p.reach_px)
    freedom = np.maximum(weight.sum(axis=1) - len(prior), 1)
    # Neighbouring pixels share the blur, and so their errors: fewer of them count.
    scale = (weight * residual**2).sum(axis=1) / freedom * max(4 * np.pi * p.blur_px**2, 1)
    covariance = np.linalg.inv(normal)[:, :2, :2] * scale[:, None, None]
    covariance[ring.sum(axis=1) <= len(prior)] = np.nan
    return Outlines(
        centre.astype(np.float64),
        covariance.astype(np.float64),
        (brightness[:, 3] - brightness[:, 0]).astype(np.float64),
    )


def _patches(gray: NDArray[np.floating], start: Single, reach: Single) -> tuple[Single, Single, Single]:
    """Return columns, rows and gray levels (n, p) of the pixels in ellipses of semi-axes ``reach``."""
    across, down = np.ceil(reach).astype(int)
    y, x = np.mgrid[-down : down + 1, -across : across + 1]
    near = (x / reach[0]) ** 2 + (y / reach[1]) ** 2 <= 1
    origin = np.round(start).astype(int)
    u, v = origin[:, :1] + x[near], origin[:, 1:] + y[near]
    h, w = gray.shape
    levels = gray[v.clip(0, h - 1), u.clip(0, w - 1)]
    return u.astype(np.float32), v.astype(np.float32), levels.astype(np.float32)


def _ring(
    du: Single, dv: Single, radii: Single, p: OutlineParameters
) -> tuple[tuple[Single, Single], tuple[Single, Single], Single, Single]:
    """Return what the model is made of at offsets (n, p) from the centre.

    The bases of inside and outside (n, p, k), each with the step and without it; the derivative of the step by the
    centre (n, p, 2); the ring (n, p) of 0 and 1.
    """
    x, y = du / radii[0], dv / radii[1]
    q = np.maximum(np.hypot(x, y), np.float32(1e-3))
    steep = np.stack([x / radii[0], y / radii[1]], axis=-1) / q[..., None]
    length = np.maximum(np.sqrt((steep**2).sum(axis=-1)), np.float32(1e-3))
    off = (q - 1) / (length * np.float32(p.blur_px))  # distance from the outline in blurs, to first order
    step = ndtr(off)[..., None]
    density = np.exp(-0.5 * off**2) / (np.float32(np.sqrt(2 * np.pi) * p.blur_px) * length)
    turn = (x + 1j * y) / q
    powers = np.cumprod(np.broadcast_to(turn[..., None], (*q.shape, p.harmonics)), axis=-1)
    one = np.ones_like(q)[..., None]
    shade = np.concatenate([one, x[..., None], y[..., None]], axis=-1)
    around = np.concatenate([one, powers.real, powers.imag], axis=-1)
    ring = ((q > p.inner) & (q < p.outer)).astype(np.float32)
    return (shade * (1 - step), shade), (around * step, around), -steep * density[..., None], ring


def _least_squares(basis: Single, weight: Single, values: Single, prior: Single) -> tuple[Single, Single]:
    """Return the solutions (n, k) and normal matrices (n, k, k) of n weighted, ridge-regularised least squares."""
    weighted = (basis * weight[..., None]).swapaxes(1, 2)
    normal = weighted @ basis + np.diag(prior)
    # A ring without pixels, or one too plain to tell its parameters apart, must not stop the others.
    normal += (
        _RIDGE
        * (1 + np.trace(normal, axis1=1, axis2=2))[:, None, None]
        * np.eye(len(prior), dtype=np.float32)
    )
    solution = np.linalg.solve(normal, weighted @ values[..., None])[..., 0]
    return solution.astype(np.float32), normal.astype(np.float32)


def _times(basis: Single, coefficients: Single) -> Single:
    return np.asarray((basis @ coefficients[..., None])[..., 0])
