"""Strips of images, by which later stages are told from them, as they are stored."""

from __future__ import annotations

from struct import Struct
from typing import cast
from zlib import crc32

import numpy as np

from spinewatch.arrays import Pixels
from spinewatch.imaging.comparison import TexturedStrip

_SUM = Struct("<I")
_HEAD = Struct("<IIIIHB")
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
        CRC-32 of the rest; number of the row, height and width of the image and width of the strip, 32 bits each; white
        level, 16 bits; bytes per gray level, 8 bits; the gray levels. All are little-endian. As PNG it would be a fifth
        smaller, and take milliseconds per stage.
    """
    size = strip.pixels.itemsize
    head = _HEAD.pack(strip.row, *strip.image_shape, strip.pixels.shape[1], strip.white, size)
    content = head + strip.pixels.astype(_TYPES[size]).tobytes()
    return _SUM.pack(crc32(content)) + content


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
    start = _SUM.size + _HEAD.size
    if len(content) < start or _SUM.unpack_from(content) != (crc32(memoryview(content)[_SUM.size :]),):
        return None
    row, height, width, columns, white, size = _HEAD.unpack_from(content, _SUM.size)
    pixels = np.frombuffer(content, _TYPES[size], offset=start).reshape(-1, columns)
    return TexturedStrip(row, cast(Pixels, pixels), white, (height, width))
