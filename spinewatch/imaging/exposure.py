"""Preprocessing of operating-room images (thesis section 4.2): exposure, iterated gamma, truncated median."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.errors import ImageError

Gray = NDArray[np.float32]
FULL_SCALE = 255.0


class Exposure(StrEnum):
    """How an image was exposed; each dark kind names how often gamma correction was applied."""

    NORMAL = "normal"
    DARK = "dark"
    VERY_DARK = "very_dark"
    GLARE = "glare"
    BLANK = "blank"


@dataclass(frozen=True)
class PreprocessParameters:
    """Parameters of ``correct_exposure``.

    ``gammas``: indices of the successive gamma corrections (thesis: 2.0, then 1.5). ``wanted_mean``: gray
    level, of 255, below which the next correction is applied. ``glare_fraction``: fraction of saturated
    pixels from which an image counts as glare. ``blank_range``: an image whose gray levels span no more than
    this is blank.
    """

    gammas: tuple[float, ...] = (2.0, 1.5)
    wanted_mean: float = 100.0
    glare_fraction: float = 0.2
    blank_range: float = 4.0


def to_gray(image: NDArray[Any]) -> Gray:
    """Return an 8- or 16-bit image (H, W) as float32 gray levels of 0..255.

    Sixteen-bit files often hold 10, 12 or 14 bits: the full scale is the smallest of these that holds the
    maximum. Raises ``ImageError`` for other shapes and types.
    """
    if image.ndim != 2 or image.size == 0:
        raise ImageError(f"an image must be a two-dimensional gray picture, not of shape {image.shape}")
    if image.dtype == np.uint8:
        return image.astype(np.float32)
    if image.dtype == np.uint16:
        largest = int(image.max())
        full = next(2**bits - 1 for bits in (8, 10, 12, 14, 16) if largest < 2**bits)
        return image.astype(np.float32) * np.float32(FULL_SCALE / full)
    raise ImageError(f"an image must have 8 or 16 bits a pixel, not {image.dtype}")


def correct_exposure(gray: Gray, parameters: PreprocessParameters) -> tuple[Gray, Exposure]:
    """Return gray levels (H, W) after as many gamma corrections (eq. 4.1) as the exposure asks for, and its kind.

    The thesis always applied both iterations by hand-picked practice; here an iteration is applied while the
    mean gray level is below ``wanted_mean``, so that pictures which are bright or already corrected stay as
    they are.
    """
    if float(np.ptp(gray)) <= parameters.blank_range:
        return gray, Exposure.BLANK
    if float((gray >= FULL_SCALE - 1).mean()) >= parameters.glare_fraction:
        return gray, Exposure.GLARE
    kinds = (Exposure.NORMAL, Exposure.DARK, Exposure.VERY_DARK)
    applied = 0
    for gamma in parameters.gammas:
        if float(gray.mean()) >= parameters.wanted_mean:
            break
        gray = gamma_correct(gray, gamma)
        applied += 1
    return gray, kinds[min(applied, 2)]


def reduce_image(gray: Gray, factor: int) -> Gray:
    """Return means over blocks of ``factor`` x ``factor`` pixels, leaving out what fills no block at the far edges."""
    if factor == 1:
        return gray
    h, w = (n // factor for n in gray.shape)
    blocks = gray[: h * factor, : w * factor].reshape(h, factor, w, factor)
    return np.asarray(blocks.mean(axis=(1, 3)), dtype=np.float32)


def gamma_correct(gray: Gray, gamma: float) -> Gray:
    """Return ``255 (v / 255)^(1/gamma)`` (eq. 4.1) of gray levels of 0..255."""
    level = gray / np.float32(FULL_SCALE)
    np.power(level, 1 / gamma, out=level)
    level *= np.float32(FULL_SCALE)
    return level


def log_tone(gray: Gray, offset: float, blur_px: float) -> Gray:
    """Return ``log(v + offset)`` of gray levels, smoothed by a Gaussian of ``blur_px``.

    The logarithm is the limit of ever more gamma corrections: contrast becomes a ratio of reflectances. What little
    is smoothed is noise, since no lens is that sharp.
    """
    smooth = cv2.GaussianBlur(gray, (0, 0), blur_px) if blur_px > 0 else gray
    tone = smooth + np.float32(offset)
    return np.asarray(np.log(tone, out=tone), dtype=np.float32)


def truncated_median_filter(gray: Gray) -> Gray:
    """Return the 3x3 truncated median of gray levels (H, W): a robust estimate of the local mode (section 4.2.3).

    Of nine sorted values the outermost on each side is left out as unstable (the noniles of the thesis); the
    longer tail is then cut to the length of the shorter one about the median, and the median of what remains
    is returned.
    """
    padded = np.pad(gray, 1, mode="edge")
    h, w = gray.shape
    window = np.stack([padded[i : i + h, j : j + w] for i in range(3) for j in range(3)])
    window.sort(axis=0)
    low, median, high = window[1], window[4], window[7]
    reach = np.minimum(median - low, high - median)
    below = (window[1:4] < median - reach).sum(axis=0)
    above = (window[5:8] > median + reach).sum(axis=0)
    # Seven values 1..7 remain less those cut; twice the index of the median of what is left.
    doubled = 8 + below - above
    lower = np.take_along_axis(window, (doubled // 2)[None], axis=0)[0]
    upper = np.take_along_axis(window, ((doubled + 1) // 2)[None], axis=0)[0]
    return np.asarray((lower + upper) / 2, dtype=np.float32)
