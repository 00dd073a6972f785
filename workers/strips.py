"""Strips of images, by which later stages are told from them, as they are stored."""

from __future__ import annotations

from struct import Struct
from typing import cast

import numpy as np

from spinewatch.arrays import Pixels
from spinewatch.imaging.comparison import TexturedStrip

_HEAD = Struct("<IIIIB")
_TYPES = {1: "<u1", 2: "<u2"}


def packed(strip: TexturedStrip) -> bytes:
    """Return what is stored of a strip.

    Parameters
    ----------
    strip
        The strip.

    Returns
    -------
    bytes
        Its place, the height and width of the image and the width of the strip, 32 bits each, the bytes per gray level,
        8 bits, then the gray levels; all are little-endian. PNG would save a fifth, and takes milliseconds per stage.
    """
    size = strip.pixels.itemsize
    head = _HEAD.pack(strip.place, *strip.image_shape, strip.pixels.shape[1], size)
    return head + strip.pixels.astype(_TYPES[size]).tobytes()


def unpacked(content: bytes) -> TexturedStrip | None:
    """Return a stored strip.

    Parameters
    ----------
    content
        What is stored of it.

    Returns
    -------
    TexturedStrip or None
        The strip; None when it is damaged.
    """
    if len(content) < _HEAD.size:
        return None
    place, height, width, columns, size = _HEAD.unpack_from(content)
    if size not in _TYPES or columns == 0 or (len(content) - _HEAD.size) % (columns * size):
        return None
    pixels = np.frombuffer(content, _TYPES[size], offset=_HEAD.size).reshape(-1, columns)
    return TexturedStrip(place, cast(Pixels, pixels), (height, width))
