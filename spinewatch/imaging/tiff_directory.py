"""The directory of a TIFF file, walked under limits before a decoder reads it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from spinewatch.errors import ImageError

SIGNATURES = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
"""The first bytes of a TIFF file and of a BigTIFF file."""

_VALUE_BYTES = {
    1: 1,
    2: 1,
    3: 2,
    4: 4,
    5: 8,
    6: 1,
    7: 1,
    8: 2,
    9: 4,
    10: 8,
    11: 4,
    12: 8,
    13: 4,
    16: 8,
    17: 8,
    18: 8,
}
_RATIONALS = frozenset({5, 10})
_COUNTS = frozenset({1, 3, 4, 16})
"""Types of unsigned integers: BYTE, SHORT, LONG and LONG8."""
_BYTES = frozenset({1, 2, 6, 7})

_WIDTH, _LENGTH = 256, 257
_PHOTOMETRIC = 262
_READABLE = frozenset(range(7))
"""Photometric interpretations: white or black as zero, RGB, palette, mask, CMYK and YCbCr."""
_LAB = frozenset({8, 9, 10})
_TILE_WIDTH, _TILE_LENGTH = 322, 323
_SEGMENTS = frozenset({273, 279, 324, 325})
"""Offsets and sizes of strips and of tiles."""
_LAYOUT = frozenset({256, 257, 258, 259, 262, 266, 274, 277, 278, 284, 317, 322, 323, 338, 339}) | _SEGMENTS
"""Tags that say how pixels are stored: integers, at least one each."""

_MAX_ENTRIES = 256
_MAX_SEGMENTS = 16_384
_MAX_RATIONALS = 1024
_MAX_NUMBERS = 200_000
_MAX_BYTES = 1 << 20
_MAX_TILE_PIXELS = 64_000_000
_DAMAGED = "the TIFF file is damaged or incomplete; copy it again"
_TOO_MANY = "the TIFF file has too many entries, strips or tiles; export it again, without metadata"


@dataclass(frozen=True)
class _Layout:
    """Widths of the fields of a directory, which differ between TIFF and BigTIFF."""

    order: Literal["little", "big"]
    first: int
    number: int
    offset: int

    def integer(self, data: bytes, position: int, size: int) -> int:
        field = data[position : position + size]
        if len(field) < size:
            raise ImageError(_DAMAGED)
        return int.from_bytes(field, self.order)


def tiff_size(data: bytes) -> tuple[int, int]:
    """Return the size of a TIFF file that can be read at a bounded cost.

    Parameters
    ----------
    data
        Contents of a file that begins with one of `SIGNATURES`.

    Returns
    -------
    tuple of int
        Width and height as stored, px.

    Raises
    ------
    ImageError
        If the file has more entries, strips or values than any camera writes, a tag of the wrong type, a colour space
        that is not supported, several images, or no image.

    References
    ----------
    TIFF 6.0 (Adobe, 1992), section 2. BigTIFF has numbers of 8 bytes.
    """
    order: Literal["little", "big"] = "little" if data[:2] == b"II" else "big"
    is_big = data[2:4] in (b"+\0", b"\0+")
    layout = _Layout(order, 8, 8, 8) if is_big else _Layout(order, 4, 2, 4)
    start = layout.integer(data, layout.first, layout.offset)
    n_entries = layout.integer(data, start, layout.number)
    if not 0 < n_entries <= _MAX_ENTRIES:
        raise ImageError(_TOO_MANY)
    entry_bytes = 4 + 2 * layout.offset
    values: dict[int, int] = {}
    numbers = byte_count = 0
    for index in range(n_entries):
        position = start + layout.number + index * entry_bytes
        tag, kind = layout.integer(data, position, 2), layout.integer(data, position + 2, 2)
        count = layout.integer(data, position + 4, layout.offset)
        size = _VALUE_BYTES.get(kind, 1)
        _check_entry(tag, kind, count, len(data) // size)
        if kind in _BYTES:
            byte_count += count
        else:
            numbers += count
        if tag in _LAYOUT:
            inline = count * size <= layout.offset
            value_at = position + 4 + layout.offset
            place = value_at if inline else layout.integer(data, value_at, layout.offset)
            values[tag] = layout.integer(data, place, size)
    if numbers > _MAX_NUMBERS or byte_count > _MAX_BYTES:
        raise ImageError(_TOO_MANY)
    if layout.integer(data, start + layout.number + n_entries * entry_bytes, layout.offset):
        raise ImageError("the file holds several images; send one image per file")
    if not (values.get(_WIDTH) and values.get(_LENGTH)):
        raise ImageError(_DAMAGED)
    _check_colour(values.get(_PHOTOMETRIC, 1))
    if values.get(_TILE_WIDTH, 1) * values.get(_TILE_LENGTH, 1) > _MAX_TILE_PIXELS:
        raise ImageError(_TOO_MANY)
    return values[_WIDTH], values[_LENGTH]


def _check_colour(photometric: int) -> None:
    if photometric not in _READABLE:
        kind = "L*a*b*" if photometric in _LAB else f"of kind {photometric}"
        raise ImageError(f"the TIFF file has colour {kind}, which is not supported; export it as gray or RGB")


def _check_entry(tag: int, kind: int, count: int, most: int) -> None:
    if tag in _LAYOUT and (kind not in _COUNTS or count == 0):
        raise ImageError("the TIFF file describes its pixels with values of the wrong type; export it again")
    if count > most:
        raise ImageError(_DAMAGED)
    if (tag in _SEGMENTS and count > _MAX_SEGMENTS) or (kind in _RATIONALS and count > _MAX_RATIONALS):
        raise ImageError(_TOO_MANY)
