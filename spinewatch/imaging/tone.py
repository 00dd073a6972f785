"""Gray levels at a common scale, and their logarithm."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Int, Single
from spinewatch.errors import ImageError

FULL_SCALE = 255.0
"""Gray level of white."""

_BIT_DEPTHS = (8, 10, 12, 14, 16)
_MIN_EXCESS_BITS = 4
_MAX_DEFECT_SHARE = 1e-4
_PATCH_OFFSET = np.float32(4.0)
"""Part of the networks' definition: their weights were fitted to logarithms with this offset."""


def to_gray(image: NDArray[Any]) -> Single:
    """Return an image as gray levels of 0..255.

    Files of 16 bits often hold 10, 12 or 14 bits: full scale is the smallest of these depths that holds the maximum.
    The defects of `defective_pixels` do not count and become white.

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
        return scaled(image, white_level(image))
    raise ImageError(f"an image must have 8 or 16 bits per pixel, not {image.dtype}; export it again")


def scaled(raw: NDArray[Any], white: int) -> Single:
    """Return raw gray levels as 0..255.

    Parameters
    ----------
    raw
        Raw gray levels of an image or of a part of it, shape (H, W).
    white
        Level that is white in the image; those above it are defects and become white.

    Returns
    -------
    Single
        New array of gray levels of 0..255, shape (H, W).

    Examples
    --------
    >>> scaled(np.array([[0, 1023, 65535]], np.uint16), 1023)
    array([[  0., 255., 255.]], dtype=float32)
    """
    return np.asarray(np.minimum(raw, white).astype(np.float32) * np.float32(FULL_SCALE / white))


def white_level(image: NDArray[Any]) -> int:
    """Return the level that is white in an image.

    Parameters
    ----------
    image
        Raw gray levels, shape (H, W), 8 or 16 bits.

    Returns
    -------
    int
        255 for 8 bits; for 16 bits full scale of the smallest depth that holds all pixels but the defects.

    Examples
    --------
    >>> white_level(np.array([[0, 700]], np.uint16))
    1023
    """
    if image.dtype == np.uint8:
        return int(FULL_SCALE)
    defects = defective_pixels(image)
    if len(defects):
        u, v = defects.T
        image = image.copy()
        image[v, u] = 0
    return _full_scale(int(image.max()))


def _full_scale(largest: int) -> int:
    """Return the white level of the smallest bit depth that holds a level."""
    return min((1 << bits) - 1 for bits in _BIT_DEPTHS if largest < 1 << bits)


def defective_pixels(image: NDArray[Any]) -> Int:
    """Return lone pixels whose level needs a bit depth that no other pixel uses.

    One hot pixel at 65535 among levels of 12 bits would make the rest of the image dark.

    Parameters
    ----------
    image
        Raw gray levels, shape (H, W), 8 or 16 bits.

    Returns
    -------
    Int
        Positions (u, v) of pixels above a depth of 4 bits less, which holds all others, shape (n, 2), px; none when
        they touch each other, as the pixels of a highlight do, and none in images of 8 bits, where a defect looks like
        a highlight.

    Examples
    --------
    >>> image = np.full((200, 200), 4000, np.uint16)
    >>> image[40, 60] = 65535
    >>> defective_pixels(image)
    array([[60, 40]])
    """
    none = np.empty((0, 2), dtype=np.intp)
    if image.dtype != np.uint16:
        return none
    level = _full_scale(int(image.max())) >> _MIN_EXCESS_BITS
    if level < FULL_SCALE:
        return none
    above = (image > level).astype(np.uint8)
    count = cv2.countNonZero(above)
    if not 0 < count <= max(1.0, _MAX_DEFECT_SHARE * image.size):
        return none
    neighbours = cv2.boxFilter(above, cv2.CV_16U, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
    if int(neighbours[above > 0].max()) > 1:
        return none
    return np.argwhere(above)[:, ::-1]


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
    return _log(smooth + np.float32(offset))


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
    return _log(gray)


def _log(values: Single) -> Single:
    """Return the logarithm of values (H, W), computed in place; OpenCV takes a third of the time of NumPy."""
    return np.asarray(cv2.log(values, values), dtype=np.float32)
