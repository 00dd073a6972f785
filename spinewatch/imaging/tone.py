"""Gray levels at a common scale, and their logarithm."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Single
from spinewatch.errors import ImageError

FULL_SCALE = 255.0
"""Gray level of white."""

_BIT_DEPTHS = (8, 10, 12, 14, 16)
_PATCH_OFFSET = np.float32(4.0)
"""Part of the networks' definition: their weights were fitted to logarithms with this offset."""


def to_gray(image: NDArray[Any]) -> Single:
    """Return an image as gray levels of 0..255.

    Files of 16 bits often hold 10, 12 or 14 bits: full scale is the smallest of these depths that holds the maximum.

    Parameters
    ----------
    image
        Raw gray levels, shape (H, W), 8 or 16 bits.

    Returns
    -------
    Single
        New array of gray levels of 0..255, shape (H, W).

    Raises
    ------
    ImageError
        For another shape or type.

    Examples
    --------
    >>> to_gray(np.array([[0, 1023]], np.uint16))
    array([[  0., 255.]], dtype=float32)
    """
    if image.ndim != 2 or image.size == 0:
        raise ImageError(
            f"an image must be a two-dimensional gray image, not of shape {image.shape}; send the camera's own frame"
        )
    if image.dtype == np.uint8:
        return image.astype(np.float32)
    if image.dtype == np.uint16:
        largest = int(image.max())
        full = next(2**bits - 1 for bits in _BIT_DEPTHS if largest < 2**bits)
        return image.astype(np.float32) * np.float32(FULL_SCALE / full)
    raise ImageError(f"an image must have 8 or 16 bits per pixel, not {image.dtype}; export it again")


def log_tone(gray: Single, offset: float, blur_px: float) -> Single:
    """Return the logarithm of gray levels, optionally smoothed before.

    Contrast becomes a ratio of reflectances, independent of the brightness of the lamp. The logarithm is the limit of
    repeated gamma corrections.

    Parameters
    ----------
    gray
        Gray levels of 0..255, shape (H, W).
    offset
        Gray levels added before the logarithm, which limits noise in dark regions.
    blur_px
        Standard deviation of the Gaussian filter, px; 0 for none. A value below the resolution of the lens removes
        noise only.

    Returns
    -------
    Single
        New array ``log(gray + offset)``, shape (H, W).

    Examples
    --------
    >>> log_tone(np.array([[0.0, 251.0]], np.float32), offset=4.0, blur_px=0.0).round(3)
    array([[1.386, 5.541]], dtype=float32)
    """
    smooth = cv2.GaussianBlur(gray, (0, 0), blur_px) if blur_px > 0 else gray
    tone = smooth + np.float32(offset)
    return np.asarray(np.log(tone, out=tone), dtype=np.float32)


def patch_tone(gray: Single) -> Single:
    """Return the logarithm of gray levels for the ball networks, computed in place.

    Parameters
    ----------
    gray
        Gray levels of 0..255, shape (H, W); overwritten, because images may be large.

    Returns
    -------
    Single
        The same array, with the logarithms.
    """
    gray += _PATCH_OFFSET
    return np.asarray(np.log(gray, out=gray))
