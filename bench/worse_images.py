"""Sound images made worse, each in one way: what the triad doubt is fitted to beside sound ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Float

Worse = Callable[[Float, np.random.Generator], Float]
"""From gray levels (H, W), 0 to 255, to worse ones."""


def _noise(sd: float) -> Worse:
    return lambda gray, rng: gray + rng.normal(0, sd, gray.shape)


def _jpeg(quality: int) -> Worse:
    def compressed(gray: Float, rng: np.random.Generator) -> Float:
        _, data = cv2.imencode(
            ".jpg", gray.clip(0, 255).astype(np.uint8), (cv2.IMWRITE_JPEG_QUALITY, quality)
        )
        return np.asarray(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE), dtype=np.float64)

    return compressed


def _defocus(sd_px: float) -> Worse:
    return lambda gray, rng: np.asarray(cv2.GaussianBlur(gray, (0, 0), sd_px)) + rng.normal(0, 1, gray.shape)


def _low_contrast(fraction: float) -> Worse:
    def lowered(gray: Float, rng: np.random.Generator) -> Float:
        mean = np.asarray(cv2.GaussianBlur(gray, (0, 0), 12.0))
        return mean + fraction * (gray - mean) + rng.normal(0, 1.5, gray.shape)

    return lowered


def _matte(gray: Float, rng: np.random.Generator) -> Float:
    """Return an image whose dark places have no highlights."""
    opened = cv2.morphologyEx(gray, cv2.MORPH_OPEN, np.ones((5, 5), np.uint8))
    dark = cv2.GaussianBlur((opened < 70).astype(np.float64), (0, 0), 1.0)
    return gray * (1 - dark) + opened * dark + rng.normal(0, 1, gray.shape)


def _smeared(gray: Float, rng: np.random.Generator) -> Float:
    """Return an image with strokes of several gray levels over it."""
    height, width = gray.shape
    for _ in range(60):
        start = rng.uniform((0.2 * width, 0.2 * height), (0.8 * width, 0.8 * height))
        stroke = (start + np.cumsum(rng.normal(0, 0.01 * width, (6, 2)), axis=0)).astype(np.int32)
        cover = np.zeros(gray.shape)
        cv2.polylines(cover, [stroke.reshape(-1, 1, 2)], False, 1.0, int(rng.integers(2, 6)))
        cover = np.asarray(cv2.GaussianBlur(cover, (0, 0), 0.8))
        gray = gray * (1 - cover) + rng.choice((20.0, 30.0, 60.0, 150.0)) * cover
    return gray + rng.normal(0, 1, gray.shape)


WORSE: Mapping[str, Worse] = {
    "as it is": lambda gray, rng: gray,
    "noise of 6": _noise(6),
    "noise of 12": _noise(12),
    "JPEG 60": _jpeg(60),
    "JPEG 35": _jpeg(35),
    "defocus": _defocus(1.2),
    "low contrast": _low_contrast(0.5),
    "lower contrast": _low_contrast(0.3),
    "no highlights": _matte,
    "smeared": _smeared,
}
"""The ways, by name."""


def worsened(pixels: NDArray[np.generic], way: str, rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return the pixels of an image of 8 or 16 bits as 8 bits, worse in one way."""
    gray = pixels.astype(np.float64) / (257 if pixels.dtype == np.uint16 else 1)
    return np.asarray(np.rint(WORSE[way](gray, rng).clip(0, 255)), dtype=np.uint8)
