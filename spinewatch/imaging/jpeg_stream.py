"""Check of the entropy-coded data of a JPEG file.

libjpeg decodes a damaged stream without an error: it warns that the data ended too early or that some were left over,
and Pillow does not pass the warnings on. Blocks that are lost or gained this way displace the rest of the image, which
is pure disparity.
"""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

_SOS, _EOI, _FILL, _STUFFED = 0xDA, 0xD9, 0xFF, 0x00
_RESTARTS = range(0xD0, 0xD8)
_PROGRESSIVE = 0xC2
_SURPLUS = b"\x55" * 8
_CHANGES = (0x55, 0xAA, 0x33)
_N_CHANGED = 4
_MIN_TESTED = 64


def is_stream_complete(data: bytes) -> bool:
    """Return whether a JPEG's entropy-coded data encode exactly its image.

    Data inserted before the end of a sound segment are never read; if the image then differs, the segment was too
    short. The last bytes of a sound segment are read; if the image remains the same however they are changed, some
    data were left over. The latter is not tested for progressive files, whose last scan may encode nothing visible, for
    segments that end with a restart marker, and for those of a few bytes.

    Parameters
    ----------
    data
        Contents of a JPEG file that Pillow decodes.

    Returns
    -------
    bool
        False for a damaged file. Damage that keeps the number of blocks is not detected.

    Examples
    --------
    >>> noise = np.random.default_rng(1).integers(0, 256, (64, 64), dtype=np.uint8)
    >>> buffer = BytesIO()
    >>> Image.fromarray(noise).save(buffer, "JPEG")
    >>> data = buffer.getvalue()
    >>> is_stream_complete(data), is_stream_complete(data[:900] + data[960:])
    (True, False)
    """
    image, segments = _decode(data), list(_segments(data))
    if not segments or not _equal(image, _decode(_lengthened(data, segments))):
        return False
    if _is_progressive(data, segments[0][0]):
        return True
    ends = [
        (start, end)
        for start, end in segments
        if end - start >= _MIN_TESTED and data[end + 1 : end + 2] not in _restart_bytes()
    ]
    return all(
        any(not _equal(image, _decode(_changed(data, *segment, mask))) for mask in _CHANGES)
        for segment in ends
    )


def _restart_bytes() -> frozenset[bytes]:
    return frozenset(bytes((marker,)) for marker in _RESTARTS)


def _segments(data: bytes) -> Iterator[tuple[int, int]]:
    """Yield start and end of each entropy-coded segment: from the header of a scan or a restart marker to a marker."""
    position = 2
    while (position := data.find(b"\xff", position)) >= 0 and position + 4 <= len(data):
        marker = data[position + 1]
        if marker == _FILL:
            position += 1
            continue
        if marker == _EOI:
            return
        position += 2
        if marker not in _RESTARTS:
            position += int.from_bytes(data[position : position + 2], "big")
        if marker == _SOS or marker in _RESTARTS:
            start, position = position, _next_marker(data, position)
            yield start, position


def _next_marker(data: bytes, position: int) -> int:
    """Return the position of the next marker, or the length of the data."""
    while (position := data.find(b"\xff", position)) >= 0 and position + 1 < len(data):
        if data[position + 1] != _STUFFED:
            return position
        position += 2
    return len(data)


def _is_progressive(data: bytes, end: int) -> bool:
    """Return whether the frame header before the first scan is that of a progressive file."""
    position = 2
    while position + 4 <= end and data[position] == _FILL:
        if data[position + 1] == _PROGRESSIVE:
            return True
        position += 2 + int.from_bytes(data[position + 2 : position + 4], "big")
    return False


def _lengthened(data: bytes, segments: list[tuple[int, int]]) -> bytes:
    """Return the file with surplus data at the end of every segment."""
    parts, last = [], 0
    for _, end in segments:
        parts += [data[last:end], _SURPLUS]
        last = end
    return b"".join((*parts, data[last:]))


def _changed(data: bytes, start: int, end: int, mask: int) -> bytes:
    """Return the file with the last bytes of a segment changed, markers and stuffed bytes excepted."""
    changed, left = bytearray(data), _N_CHANGED
    for position in range(end - 1, start, -1):
        if _FILL not in (data[position], data[position - 1], data[position] ^ mask):
            changed[position] ^= mask
            left -= 1
        if not left:
            break
    return bytes(changed)


def _equal(image: NDArray[Any] | None, other: NDArray[Any] | None) -> bool:
    """Return whether both were decoded to the same samples."""
    return image is not None and other is not None and np.array_equal(image, other)


def _decode(data: bytes) -> NDArray[Any] | None:
    """Return the decoded samples, None when the decoder refuses."""
    try:
        with Image.open(BytesIO(data), formats=("JPEG",)) as image:
            return np.asarray(image)
    except MemoryError:
        raise
    except Exception:  # decoders of changed bytes raise exceptions of any class
        return None
