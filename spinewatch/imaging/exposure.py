"""Exposure of operating-room images and its correction (thesis section 4.2)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import cv2
import numpy as np

from spinewatch.arrays import Single
from spinewatch.imaging.tone import FULL_SCALE


class Exposure(StrEnum):
    """Kind of exposure of an image; the dark kinds differ in the number of gamma corrections applied."""

    NORMAL = "normal"
    DARK = "dark"
    VERY_DARK = "very_dark"
    GLARE = "glare"
    BLANK = "blank"


@dataclass(frozen=True)
class ExposureParameters:
    """Parameters of `correct_exposure`.

    Attributes
    ----------
    gammas
        Exponents of the successive gamma corrections (thesis: 2.0, then 1.5).
    min_mean
        Mean gray level, of 255, below which the next correction is applied.
    glare_fraction
        Fraction of saturated pixels from which an image counts as glare.
    blank_range
        Largest range of gray levels of an image that counts as blank.
    """

    gammas: tuple[float, ...] = (2.0, 1.5)
    min_mean: float = 100.0
    glare_fraction: float = 0.2
    blank_range: float = 4.0


def correct_exposure(gray: Single, parameters: ExposureParameters) -> tuple[Single, Exposure]:
    """Return an image with gamma corrections as its exposure requires.

    Parameters
    ----------
    gray
        Gray levels of 0..255, shape (H, W).
    parameters
        Corrections and thresholds.

    Returns
    -------
    gray : Single
        Corrected gray levels of 0..255, shape (H, W); the input itself when no correction applies.
    exposure : Exposure
        Kind of exposure of the input.

    References
    ----------
    Thesis eq. 4.1. The thesis always applies both corrections; here each is applied only while the mean gray level is
    below ``min_mean``, so that images that are bright or already corrected are not changed.

    Examples
    --------
    >>> dark = np.linspace(0, 120, 64, dtype=np.float32).reshape(8, 8)
    >>> corrected, exposure = correct_exposure(dark, ExposureParameters())
    >>> str(exposure)
    'dark'
    >>> bool(corrected.mean() >= 100)
    True
    """
    darkest, brightest, *_ = cv2.minMaxLoc(gray)
    if brightest - darkest <= parameters.blank_range:
        return gray, Exposure.BLANK
    if np.count_nonzero(gray >= FULL_SCALE - 1) >= parameters.glare_fraction * gray.size:
        return gray, Exposure.GLARE
    kinds = (Exposure.NORMAL, Exposure.DARK, Exposure.VERY_DARK)
    applied = 0
    for gamma in parameters.gammas:
        if cv2.mean(gray)[0] >= parameters.min_mean:
            break
        gray = gamma_correct(gray, gamma)
        applied += 1
    return gray, kinds[min(applied, 2)]


def gamma_correct(gray: Single, gamma: float) -> Single:
    """Return gray levels after a gamma correction.

    Parameters
    ----------
    gray
        Gray levels of 0..255, shape (H, W).
    gamma
        Exponent; above 1 brightens.

    Returns
    -------
    Single
        ``255 (gray / 255)^(1 / gamma)``, shape (H, W).

    References
    ----------
    Thesis eq. 4.1.

    Examples
    --------
    >>> gamma_correct(np.array([0.0, 63.75, 255.0], np.float32), 2.0)
    array([  0. , 127.5, 255. ], dtype=float32)
    """
    level = gray / np.float32(FULL_SCALE)
    cv2.pow(level, 1 / gamma, level)  # several times faster than NumPy
    level *= np.float32(FULL_SCALE)
    return level
