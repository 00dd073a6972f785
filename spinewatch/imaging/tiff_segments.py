"""Check of the strips or tiles of a TIFF file, each of which is compressed by itself.

libtiff decodes a damaged strip without an error as long as it yields enough bytes. What is displaced this way is pure
disparity.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from spinewatch.errors import ImageError
from spinewatch.imaging.deflate import inflates_to
from spinewatch.imaging.jpeg_segments import SIGNATURE, jpeg_size
from spinewatch.imaging.jpeg_stream import is_stream_complete
from spinewatch.imaging.lzw import lzw_expands_to
from spinewatch.imaging.packbits import packbits_expand_to

_WIDTH, _HEIGHT, _BITS, _COMPRESSION, _PHOTOMETRIC = 256, 257, 258, 259, 262
_FILL_ORDER, _SAMPLES, _ROWS_PER_STRIP, _PLANES = 266, 277, 278, 284
_STRIPS, _STRIP_BYTES, _TILE_WIDTH, _TILE_HEIGHT, _TILES, _TILE_BYTES = 273, 279, 322, 323, 324, 325
_JPEG_TABLES = 347
_YCBCR, _REVERSED, _SEPARATE = 6, 2, 2
_NONE, _LZW, _JPEG, _DEFLATE, _PACKBITS = 1, 5, 7, (8, 32946), 32773
_UNCHECKED = {
    2: "CCITT run lengths",
    3: "CCITT Group 3",
    4: "CCITT Group 4",
    6: "JPEG of TIFF before 1995",
    32771: "words of 16 bits",
    32809: "ThunderScan",
    34676: "SGI LogLuv",
    34677: "SGI LogLuv",
    34925: "LZMA",
    50000: "Zstandard",
    50001: "WebP",
}
_REVERSED_BITS = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
_MAX_PADDED_PIXELS = 128_000_000
_DAMAGED = (
    "the TIFF image is damaged or incomplete (its strips or tiles are not those of its size); copy it again"
)


@dataclass(frozen=True)
class _Segment:
    """A strip or tile: its compressed bytes, and width, height and bits per pixel of what they must be."""

    data: bytes
    width: int
    height: int
    bits: int

    @property
    def row(self) -> int:
        """Bytes of a row."""
        return -(-self.width * self.bits // 8)

    @property
    def size(self) -> int:
        """Bytes of all rows."""
        return self.row * self.height


def require_whole_segments(data: bytes, tags: Mapping[int, Any]) -> None:
    """Refuse a TIFF file with a compressed strip or tile that is not exactly its rows.

    Parameters
    ----------
    data
        Contents of a file whose directory `tiff_size` has accepted.
    tags
        Values of the tags of its directory, as Pillow gives them.

    Raises
    ------
    ImageError
        If a strip or tile is missing, damaged, too short or too long, or if the compression is one whose damage cannot
        be found. What Deflate has compressed has a checksum; in the others, damage that keeps the number of bytes or of
        blocks may remain.

    References
    ----------
    TIFF 6.0 (Adobe, 1992), sections 3 (strips), 9 (PackBits), 13 (LZW) and 15 (tiles). TIFF Technical Note 2 (1995),
    for JPEG. TIFF Specification Supplement 2 (Adobe, 2002), for Deflate.

    Examples
    --------
    >>> from io import BytesIO
    >>> from PIL import Image
    >>> buffer = BytesIO()
    >>> Image.new("L", (30, 20)).save(buffer, "TIFF", compression="tiff_adobe_deflate")
    >>> with Image.open(buffer) as image:
    ...     require_whole_segments(buffer.getvalue(), image.tag_v2)
    """
    compression = tags.get(_COMPRESSION, _NONE)
    if compression not in (_NONE, _LZW, _JPEG, *_DEFLATE, _PACKBITS):
        kind = _UNCHECKED.get(compression, f"of kind {compression}")
        raise ImageError(
            f"the TIFF image has compression {kind}, in which damage cannot be found; export it"
            " uncompressed, with Deflate, or as PNG"
        )
    if tags.get(_PHOTOMETRIC) == _YCBCR and compression not in (_NONE, _JPEG):
        raise ImageError("the TIFF image has compressed YCbCr colour; export it as gray or RGB")
    if compression != _NONE and not all(
        _is_whole(segment, compression, tags) for segment in _segments(data, tags)
    ):
        raise ImageError(_DAMAGED)


def _segments(data: bytes, tags: Mapping[int, Any]) -> Iterator[_Segment]:
    """Yield all strips or tiles."""
    width, height, samples = tags[_WIDTH], tags[_HEIGHT], tags.get(_SAMPLES, 1)
    bits = tags.get(_BITS, (1,))
    is_tiled = _TILES in tags
    across = tags.get(_TILE_WIDTH, 0) if is_tiled else width
    down = tags.get(_TILE_HEIGHT, 0) if is_tiled else min(tags.get(_ROWS_PER_STRIP, height), height)
    is_separate = samples > 1 and tags.get(_PLANES) == _SEPARATE
    if not (across and down) or len(set(bits)) > 1:
        raise ImageError(_DAMAGED)
    columns, rows, planes = -(-width // across), -(-height // down), samples if is_separate else 1
    places = tags.get(_TILES if is_tiled else _STRIPS, ())
    sizes = tags.get(_TILE_BYTES if is_tiled else _STRIP_BYTES, ())
    if (
        not columns * rows * planes == len(places) == len(sizes)
        or len(places) * across * down > _MAX_PADDED_PIXELS * planes
    ):
        raise ImageError(_DAMAGED)
    for index, (place, size) in enumerate(zip(places, sizes, strict=True)):
        part = data[place : place + size]
        if len(part) < size:
            raise ImageError(_DAMAGED)
        above = index // columns % rows * down
        yield _Segment(
            part,
            across,
            down if is_tiled else min(down, height - above),
            bits[0] * (1 if is_separate else samples),
        )


def _is_whole(segment: _Segment, compression: int, tags: Mapping[int, Any]) -> bool:
    """Return whether a strip or tile is compressed data of exactly its rows."""
    if compression == _JPEG:
        return _is_whole_jpeg(segment, bytes(tags.get(_JPEG_TABLES, b"")))
    packed = segment.data.translate(_REVERSED_BITS) if tags.get(_FILL_ORDER) == _REVERSED else segment.data
    if compression == _LZW:
        return lzw_expands_to(segment.size, packed)
    if compression == _PACKBITS:
        return packbits_expand_to(segment.row, segment.height, packed)
    return inflates_to(segment.size, [packed])


def _is_whole_jpeg(segment: _Segment, tables: bytes) -> bool:
    """Return whether a strip or tile, with the tables for all of them, is a JPEG of its size."""
    start, end = SIGNATURE[:2], b"\xff\xd9"
    if not segment.data.startswith(start):
        return False
    complete = start + tables.removeprefix(start).removesuffix(end) + segment.data.removeprefix(start)
    return jpeg_size(complete) == (segment.width, segment.height) and is_stream_complete(complete)
