"""Check of the compressed rows of a PNG file.

Pillow fills rows that are missing with black, and ignores surplus rows, the checksum of the compressed data and
whatever is missing after it.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator

from spinewatch.errors import ImageError
from spinewatch.imaging.deflate import inflates_to
from spinewatch.imaging.png_chunks import SIGNATURE

_SAMPLES = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
"""Samples per pixel by colour type."""
_PASSES = (
    *((0, 8, 0, 8), (4, 8, 0, 8), (0, 4, 4, 8), (2, 4, 0, 4)),
    *((0, 2, 2, 4), (1, 2, 0, 2), (0, 1, 1, 2)),
)
"""First column, step of columns, first row and step of rows of each pass of Adam7."""
_WHOLE = ((0, 1, 0, 1),)
_LENGTH, _OVERHEAD = 4, 12


def require_complete_rows(data: bytes) -> None:
    """Refuse a PNG file whose compressed data are not exactly the rows of its header, or that is damaged.

    Parameters
    ----------
    data
        Contents of a file whose chunks `png_size` has accepted.

    Raises
    ------
    ImageError
        If `are_rows_complete` is False.

    Examples
    --------
    >>> from io import BytesIO
    >>> from PIL import Image
    >>> buffer = BytesIO()
    >>> Image.new("L", (30, 20)).save(buffer, "PNG")
    >>> require_complete_rows(buffer.getvalue())
    """
    if not are_rows_complete(data):
        raise ImageError(
            "the PNG image is damaged or incomplete (its data are not those of its size, or its end is missing);"
            " copy it again"
        )


def are_rows_complete(data: bytes) -> bool:
    """Return whether a PNG's compressed data hold exactly the rows of its header, and the file is undamaged to its end.

    The data are inflated in pieces that are not kept, and no further than the rows need.

    Parameters
    ----------
    data
        Contents of a file whose chunks `png_size` has accepted.

    Returns
    -------
    bool
        False if a chunk is cut, its checksum is wrong or the last one, IEND, is missing; if the data chunks do not
        follow each other; or if the compressed data are damaged, too short or too long.

    References
    ----------
    W3C PNG specification, third edition, sections 5.3 (checksums), 5.6 (order), 8.1 (passes of Adam7) and 10.1
    (compression).

    Examples
    --------
    >>> from io import BytesIO
    >>> from PIL import Image
    >>> buffer = BytesIO()
    >>> Image.new("L", (30, 20)).save(buffer, "PNG")
    >>> are_rows_complete(buffer.getvalue()), are_rows_complete(buffer.getvalue()[:-1])
    (True, False)
    """
    header, parts, names = b"", [], []
    for name, content in _chunks(memoryview(data)):
        if name == b"IHDR":
            header = bytes(content)
        elif name == b"IDAT":
            parts.append(content)
        names.append(name)
    if not parts or names[-1] != b"IEND" or len(header) != 13 or header[9] not in _SAMPLES:
        return False
    first = names.index(b"IDAT")
    if names[first : first + len(parts)].count(b"IDAT") != len(parts):
        return False
    return inflates_to(_inflated_size(header), parts)


def _chunks(data: memoryview) -> Iterator[tuple[bytes, memoryview]]:
    """Yield the name and the content of each sound chunk to IEND; chunks after a damaged one are not read."""
    position = len(SIGNATURE)
    while position + _OVERHEAD <= len(data):
        start = position + 2 * _LENGTH
        end = start + int.from_bytes(data[position : position + _LENGTH], "big")
        name, checksum = bytes(data[position + _LENGTH : start]), data[end : end + _LENGTH]
        if len(checksum) < _LENGTH or zlib.crc32(data[start - _LENGTH : end]) != int.from_bytes(
            checksum, "big"
        ):
            return
        yield name, data[start:end]
        if name == b"IEND":
            return
        position = end + _LENGTH


def _inflated_size(header: bytes) -> int:
    """Return the number of bytes of all rows with their filter bytes, from the content of IHDR."""
    width, height = int.from_bytes(header[:4], "big"), int.from_bytes(header[4:8], "big")
    bits = header[8] * _SAMPLES[header[9]]
    size = 0
    for column, step, row, row_step in _PASSES if header[12] else _WHOLE:
        columns, rows = -(-(width - column) // step), -(-(height - row) // row_step)
        if columns > 0 and rows > 0:
            size += rows * (1 + -(-columns * bits // 8))
    return size
