"""General detectors to compare with, each tuned on the development scenes.

Each takes the gray levels (H, W) of an image and the nominal (width, height) of a ball in pixels, and returns positions
(n, 2), best first.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, gaussian_laplace

from spinewatch.arrays import Float, Single
from spinewatch.detection.candidates.correlation import similarity
from spinewatch.detection.candidates.segmentation import peaks
from spinewatch.detection.candidates.similarity import Measure, Templates
from spinewatch.imaging.tone import log_tone

Size = tuple[float, float]
Detector = Callable[[Single, Size], Float]

BUDGET = 100
_LOG_OFFSET = 4.0


def soft_disc(gray: Single, ball_px: Size) -> Float:
    """Correlate (RHO, eq. 4.14) the log image with a dark disc of a ball's size and a soft edge."""
    return _disc(gray, ball_px, margin=1.4, measure=Measure.RHO)


def soft_disc_filter(gray: Single, ball_px: Size) -> Float:
    """Filter the log image with the same disc: the correlation without normalization (CCM, eq. 4.16)."""
    return _disc(gray, ball_px, margin=1.6, measure=Measure.CCM)


def laplacian(gray: Single, ball_px: Size) -> Float:
    """Laplacian of Gaussian of the log image, a little above the scale of a disc of the ball's size."""
    return _peaks(gaussian_laplace(_log(gray), _sigma(ball_px, 1.15)), ball_px)


def difference_of_gaussians(gray: Single, ball_px: Size) -> Float:
    """Difference of Gaussians of the log image, 1.2 apart about the same scale."""
    log, (down, across) = _log(gray), _sigma(ball_px, 1.15)
    narrow, wide = (gaussian_filter(log, (down * k, across * k)) for k in (1.2**-0.5, 1.2**0.5))
    return _peaks(wide - narrow, ball_px)


def simple_blobs(gray: Single, ball_px: Size) -> Float:
    """OpenCV's SimpleBlobDetector for dark, roundish blobs of the ball's size in the log image, by their Laplacian."""
    p = cv2.SimpleBlobDetector.Params()
    p.minThreshold, p.maxThreshold, p.thresholdStep = 5, 250, 8
    width = 9.0
    p.minDistBetweenBlobs = 0.3 * width
    p.minArea, p.maxArea = (k * np.pi / 4 * width**2 for k in (0.3, 2.0))
    p.filterByConvexity, p.filterByCircularity = False, True
    p.minCircularity, p.minInertiaRatio = 0.5, 0.3
    enlarge = width / ball_px[0]
    found = cv2.SimpleBlobDetector.create(p).detect(_enlarged(gray, ball_px, enlarge))
    xy = _reduced(np.array([point.pt for point in found], dtype=np.float64).reshape(-1, 2), ball_px, enlarge)
    response = gaussian_laplace(_log(gray), _sigma(ball_px, 1.0))
    u, v = np.rint(xy).astype(int).T
    strength = response[v.clip(0, gray.shape[0] - 1), u.clip(0, gray.shape[1] - 1)]
    return np.asarray(xy[np.argsort(-strength)][:BUDGET])


def hough_circles(gray: Single, ball_px: Size) -> Float:
    """OpenCV's gradient Hough transform for circles of the ball's size in the log image, by its accumulator."""
    enlarge = 28 / ball_px[0]
    radius = enlarge * ball_px[0] / 2
    found = cv2.HoughCircles(
        _enlarged(gray, ball_px, enlarge),
        cv2.HOUGH_GRADIENT,
        dp=1.0,
        minDist=radius,
        param1=300,
        param2=8,
        minRadius=int(radius * 0.9),
        maxRadius=int(np.ceil(radius * 1.1)),
    )
    xy = np.empty((0, 2)) if found is None else found[0, :BUDGET, :2].astype(np.float64)
    return _reduced(xy, ball_px, enlarge)


def _log(gray: Single) -> Single:
    return log_tone(gray, _LOG_OFFSET, 0.0)


def _disc(gray: Single, ball_px: Size, margin: float, measure: Measure) -> Float:
    width, height = ball_px
    down, across = (int(np.ceil(margin / 2 * d)) for d in (height, width))
    y, x = np.mgrid[-down : down + 1, -across : across + 1]
    q = np.hypot(2 * x / width, 2 * y / height)
    disc = -1 / (1 + np.exp((q - 1) * min(ball_px) / 0.8))
    mask = (q <= margin).astype(np.float32)
    template = Templates((disc * mask)[None, None].astype(np.float32), mask)
    return _peaks(similarity(_log(gray)[None], template, measure)[0], ball_px)


def _sigma(ball_px: Size, factor: float) -> tuple[float, float]:
    """Return the scale (down, across) at which the Laplacian of a disc is strongest, times a factor."""
    return factor * ball_px[1] / 8**0.5, factor * ball_px[0] / 8**0.5


def _peaks(response: NDArray[np.floating], ball_px: Size) -> Float:
    radius = max(1, round(min(ball_px) / 3))
    xy, _ = peaks(response.astype(np.float32), BUDGET, radius, -np.inf)
    return np.asarray(xy, dtype=np.float64)


def _enlarged(gray: Single, ball_px: Size, factor: float) -> NDArray[Any]:
    """Return the log image in 8 bits, enlarged, with square pixels so that a ball is round."""
    tone = _log(gray)
    low, high = np.percentile(tone, (0.5, 99.5))
    image = np.clip(255 * (tone - low) / max(high - low, 1e-3), 0, 255).astype(np.uint8)
    down = factor * ball_px[0] / ball_px[1]
    return np.asarray(cv2.resize(image, None, fx=factor, fy=down, interpolation=cv2.INTER_CUBIC))


def _reduced(xy: Float, ball_px: Size, factor: float) -> Float:
    return np.asarray((xy + 0.5) / (factor, factor * ball_px[0] / ball_px[1]) - 0.5)


PEERS: dict[str, Detector] = {
    "soft disc, normalized": soft_disc,
    "soft disc, not normalized": soft_disc_filter,
    "Laplacian of Gaussian": laplacian,
    "difference of Gaussians": difference_of_gaussians,
    "OpenCV HoughCircles": hough_circles,
    "OpenCV SimpleBlobDetector": simple_blobs,
}
