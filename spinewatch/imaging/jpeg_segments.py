"""The segments of a JPEG file, walked under limits before a decoder reads them."""

from __future__ import annotations

from spinewatch.errors import ImageError

SIGNATURE = b"\xff\xd8\xff"
"""The first bytes of a JPEG file."""

_SOS = 0xDA
_FILL = 0xFF
_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
"""Frame headers: SOF0 to SOF15 without DHT, JPG and DAC."""
_ALONE = frozenset(range(0xD0, 0xD9))
"""Markers without a length."""
_FOREIGN = frozenset({0xC8, 0xD9, *range(0xC0), *range(0xF0, 0xFE)})
"""Markers that do not belong before an image, whose length decoders read differently."""

_MAX_SEGMENTS = 256
_MAX_METADATA_BYTES = 1 << 20
_MAX_SCANS = 100
_DAMAGED = "the JPEG file is damaged or incomplete; copy it again"
_TOO_MANY = "the JPEG file has too many segments or too long ones; export it again, without metadata"


def jpeg_size(data: bytes) -> tuple[int, int]:
    """Return the size of a JPEG file that can be read at a bounded cost.

    Parameters
    ----------
    data
        Contents of a file that begins with `SIGNATURE`.

    Returns
    -------
    tuple of int
        Width and height as stored, px.

    Raises
    ------
    ImageError
        If the file has more segments or scans than any camera writes, or no image.

    References
    ----------
    ITU-T T.81, annex B.
    """
    size: tuple[int, int] | None = None
    position, count = 2, 0
    while True:
        if position > _MAX_METADATA_BYTES or count > _MAX_SEGMENTS:
            raise ImageError(_TOO_MANY)
        if position + 4 > len(data) or data[position] != _FILL:
            raise ImageError(_DAMAGED)
        marker = data[position + 1]
        count += 1
        if marker in _FOREIGN:
            raise ImageError(_DAMAGED)
        if marker == _FILL:
            position += 1
            continue
        if marker in _ALONE:
            position += 2
            continue
        if marker == _SOS:
            break
        if marker in _FRAMES:
            height, width = (int.from_bytes(data[position + n : position + n + 2], "big") for n in (5, 7))
            size = width, height
        position += 2 + int.from_bytes(data[position + 2 : position + 4], "big")
    if size is None or not all(size):
        raise ImageError(_DAMAGED)
    if data.count(b"\xff\xda") > _MAX_SCANS:
        raise ImageError(_TOO_MANY)
    return size
