"""Sharpness of images at the balls, along rows and columns separately, so that motion blur is measured too."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import median

import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Float, Pixels


@dataclass(frozen=True)
class SharpnessParameters:
    """Parameters of `edge_widths_px` and of the judgement of blur.

    Attributes
    ----------
    n_features
        Number of the best features that are used.
    min_features
        Least number of features inside the image.
    reach
        Half length of the profiles across a feature, in ball widths and heights.
    half_profiles
        Profiles on either side of the middle one.
    max_width_px
        Largest width of edges in a sound image of small balls, px. Sound images have at most 2.5, defocus with a
        Gaussian of 1 px makes 2.7 and more.
    max_width
        The same for large balls, in ball widths and heights; the larger of both limits holds.
    sd_exponent
        Deviations grow with this power of the width over the largest one; measured on defocus and motion.
    """

    n_features: int = 20
    min_features: int = 4
    reach: float = 0.9
    half_profiles: int = 2
    max_width_px: float = 2.7
    max_width: float = 0.25
    sd_exponent: float = 1.0


def edge_widths_px(
    image: Pixels, xy_px: Float, ball_px: tuple[float, float], parameters: SharpnessParameters
) -> tuple[float, float] | None:
    """Return the width of edges at features: contrast over steepest slope, median over the features.

    Parameters
    ----------
    image
        Gray levels as stored, shape (H, W).
    xy_px
        Features, best first, shape (n, 2), px.
    ball_px
        Width and height of a ball, px.
    parameters
        Number of features and length of profiles.

    Returns
    -------
    tuple of float or None
        Width along u and along v, px; None with too few features.

    Examples
    --------
    >>> u, v = np.meshgrid(np.arange(120), np.arange(40))
    >>> balls = [(x, 20) for x in (20, 45, 70, 95)]
    >>> image = 100.0 - 80 * sum(np.hypot(u - x, v - y) < 5 for x, y in balls)
    >>> edge_widths_px(image.astype(np.uint8), np.array(balls, float), (10.0, 10.0), SharpnessParameters())
    (1.0, 1.0)
    """
    p = parameters
    reach = np.ceil(np.array(ball_px) * p.reach).astype(int)
    pixel = np.rint(xy_px[: p.n_features]).astype(int)
    margin, (height, width) = reach.max() + p.half_profiles, image.shape
    inside = np.all((pixel >= margin) & (pixel < np.array([width, height]) - margin), axis=1)
    u, v = pixel[inside].T[:, :, None, None]
    if len(u) < p.min_features:
        return None
    across = np.arange(-p.half_profiles, p.half_profiles + 1)[None, :, None]
    along_u, along_v = (np.arange(-n, n + 1)[None, None, :] for n in reach)
    return (
        _median_width(image[v + across, u + along_u].astype(np.float32)),
        _median_width(image[v + along_v, u + across].astype(np.float32)),
    )


def _median_width(profiles: NDArray[np.float32]) -> float:
    """Return the median width, px, of features with an odd number k of profiles each, (n, k, length)."""
    contrast = np.ptp(profiles, axis=2)
    slope = np.abs(np.diff(profiles, axis=2)).max(axis=2)
    widths = np.sort(contrast / np.maximum(slope, 1), axis=1)
    return float(median(widths[:, widths.shape[1] // 2].tolist()))
