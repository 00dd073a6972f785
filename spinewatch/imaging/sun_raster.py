"""Sun rasters: written, and those read whose run lengths cover rows of an odd number of bytes.

Sun pads rows to 16 bits before it packs them; Pillow does not expect the padding and shears the image. It writes none.
"""

from __future__ import annotations

import struct

import numpy as np

from spinewatch.arrays import Pixels
from spinewatch.imaging.luma import LUMA_BGR

_HEADER = struct.Struct(">8I")
_MAGIC = 0x59A66A95
_STANDARD = 1
_RGB_MAP = 1
_RUN_LENGTHS = 2
_ESCAPE = 0x80


def encode_sun_raster(image: Pixels) -> bytes:
    """Return a gray image as a Sun raster without compression.

    Parameters
    ----------
    image
        Gray levels of 8 bits, shape (H, W).

    Returns
    -------
    bytes
        Contents of a Sun raster file with a gray colour map, without which some programs show it black.

    Examples
    --------
    >>> from spinewatch.imaging.decoding import decode_image
    >>> decode_image(encode_sun_raster(np.array([[1, 2, 3], [4, 5, 6]], np.uint8)))
    array([[1, 2, 3],
           [4, 5, 6]], dtype=uint8)
    """
    height, width = image.shape
    rows = np.zeros((height, width + width % 2), np.uint8)
    rows[:, :width] = image
    colour_map = np.tile(np.arange(256, dtype=np.uint8), 3).tobytes()
    header = _HEADER.pack(_MAGIC, width, height, 8, rows.size, _STANDARD, _RGB_MAP, len(colour_map))
    return header + colour_map + rows.tobytes()


def has_padded_runs(data: bytes) -> bool:
    """Return whether a Sun raster has run lengths and rows of an odd number of bytes.

    Parameters
    ----------
    data
        Contents of a Sun raster file.

    Returns
    -------
    bool
        True if `decode_padded_runs` must decode it.
    """
    _, width, _, depth, _, kind, _, _ = _HEADER.unpack_from(data)
    return kind == _RUN_LENGTHS and bool((width * depth + 7) // 8 % 2)


def are_runs_complete(data: bytes) -> bool:
    """Return whether the run lengths of a Sun raster are exactly its rows.

    Parameters
    ----------
    data
        Contents of a Sun raster file.

    Returns
    -------
    bool
        False if the runs are too short or too long, or end within a run; True for a file without run lengths. Damage
        that keeps the number of bytes is not detected.

    Examples
    --------
    >>> header = _HEADER.pack(0x59A66A95, 3, 1, 8, 4, 2, 0, 0)
    >>> are_runs_complete(header + bytes((0x80, 1, 7, 9, 0))), are_runs_complete(header + bytes((0x80, 9, 7, 9, 0)))
    (True, False)
    """
    _, width, height, depth, _, kind, _, map_length = _HEADER.unpack_from(data)
    if kind != _RUN_LENGTHS:
        return True
    row = (width * depth + 7) // 8
    padded = (row + row % 2) * height
    return len(_unpack(data[_HEADER.size + map_length :], padded + 1)) in (row * height, padded)


def decode_padded_runs(data: bytes) -> Pixels:
    """Return the gray levels of a Sun raster with run lengths and rows of an odd number of bytes.

    Parameters
    ----------
    data
        Contents of the file, with 8 or 24 bits per pixel and without or with a colour map.

    Returns
    -------
    Pixels
        Gray levels, shape (H, W), uint8; colour is converted to luma.

    Raises
    ------
    ValueError
        For another depth, or when the runs do not fill the image.

    Examples
    --------
    >>> header = _HEADER.pack(0x59A66A95, 3, 1, 8, 4, 2, 0, 0)
    >>> decode_padded_runs(header + bytes((0x80, 1, 7, 9, 0)))
    array([[7, 7, 9]], dtype=uint8)
    """
    _, width, height, depth, _, _, _, map_length = _HEADER.unpack_from(data)
    if depth not in (8, 24):
        raise ValueError(f"{depth} bits per pixel")
    start = _HEADER.size + map_length
    row = width * depth // 8
    unpacked = _unpack(data[start:], (row + 1) * height)
    stride = row if len(unpacked) == row * height else row + 1
    if len(unpacked) < stride * height:
        raise ValueError("the runs do not fill the image")
    rows = np.frombuffer(unpacked, np.uint8, stride * height).reshape(height, stride)[:, :row]
    if depth == 24:
        return _luma(rows.reshape(height, width, 3))
    if map_length:
        red, green, blue = np.frombuffer(data, np.uint8, map_length, _HEADER.size).reshape(3, -1)
        return _luma(np.stack([blue, green, red], axis=-1))[rows]
    return rows.copy()


def _luma(bgr: Pixels) -> Pixels:
    """Return the luma (...) of blue, green and red (..., 3)."""
    luma: Pixels = np.rint(bgr @ np.array(LUMA_BGR)).astype(np.uint8)
    return luma


def _unpack(packed: bytes, limit: int) -> bytes:
    """Return unpacked run lengths, of at most a number of bytes."""
    parts, length, position = [], 0, 0
    while position < len(packed) and length < limit:
        escape = packed.find(_ESCAPE, position)
        end = len(packed) if escape < 0 else escape
        parts.append(packed[position:end])
        count = packed[end + 1] if end + 1 < len(packed) else 0
        if count == 0 and escape >= 0:
            parts.append(bytes((_ESCAPE,)))
            position = end + 2
        else:
            parts.append(packed[end + 2 : end + 3] * (count + 1))
            position = end + 3
        length = length + len(parts[-1]) + len(parts[-2])
    return b"".join(parts)[:limit]
