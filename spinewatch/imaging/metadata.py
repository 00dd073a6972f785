"""Removal of metadata from image files: texts, EXIF, XMP, colour profiles, thumbnails and whatever follows the image.

Nothing is decoded: the compressed pixels are copied as they are, and so are the fields that tell how to read them.
"""

from __future__ import annotations

import struct

from spinewatch.errors import ImageError
from spinewatch.imaging import jpeg_segments, png_chunks, tiff_directory
from spinewatch.imaging.tiff_metadata import tiff_without_metadata

_PNG_PIXELS = {b"IHDR": 13, b"PLTE": 768, b"IDAT": 1 << 31, b"IEND": 0, b"tRNS": 256}
_PNG_SMALL = {b"gAMA": 4, b"cHRM": 32, b"sRGB": 1, b"sBIT": 4, b"pHYs": 9}
_PNG_KEPT = _PNG_PIXELS | _PNG_SMALL
"""Largest length of each chunk that is kept; the small ones have numbers only."""
_PNG_OVERHEAD = 12

_JFIF, _ADOBE = 0xE0, 0xEE
_JFIF_BYTES, _ADOBE_BYTES = 16, 14
_JFIF_WITHOUT_THUMBNAIL = b"\0\x10"
_METADATA = frozenset({*range(0xE0, 0xF0), 0xFE})
_SOS, _EOI, _FILL = 0xDA, 0xD9, 0xFF
_ALONE = frozenset(range(0xD0, 0xD9))
_STUFFED = frozenset({0x00, *range(0xD0, 0xD8)})

_SUN_HEADER = struct.Struct(">8I")
_SUN_RUN_LENGTHS = 2


def without_metadata(data: bytes) -> bytes:
    """Return an image file without metadata; decoding it gives the same pixels.

    Parameters
    ----------
    data
        Contents of a file that `spinewatch.imaging.header.inspect_image` accepts.

    Returns
    -------
    bytes
        The file; the same bytes if there was nothing to remove.

    Raises
    ------
    ImageError
        If the file is a TIFF whose strips cannot be found.

    References
    ----------
    W3C PNG specification, third edition, section 11; ITU-T T.81, annex B; JFIF 1.02; TIFF 6.0.

    Examples
    --------
    >>> from io import BytesIO
    >>> from PIL import Image, PngImagePlugin
    >>> text = PngImagePlugin.PngInfo()
    >>> text.add_text("Patient", "Anna Smith")
    >>> plain, named = BytesIO(), BytesIO()
    >>> Image.new("L", (4, 3)).save(plain, "PNG")
    >>> Image.new("L", (4, 3)).save(named, "PNG", pnginfo=text)
    >>> without_metadata(named.getvalue()) == plain.getvalue()
    True
    """
    if data.startswith(png_chunks.SIGNATURE):
        return _png(data)
    if data.startswith(jpeg_segments.SIGNATURE):
        return _jpeg(data)
    if data.startswith(tiff_directory.SIGNATURES):
        return tiff_without_metadata(data)
    return _sun(data)


def _png(data: bytes) -> bytes:
    parts, position = [png_chunks.SIGNATURE], len(png_chunks.SIGNATURE)
    while position < len(data):
        length, name = int.from_bytes(data[position : position + 4], "big"), data[position + 4 : position + 8]
        end = position + length + _PNG_OVERHEAD
        if length <= _PNG_KEPT.get(name, -1):
            parts.append(data[position:end])
        if name == b"IEND":
            break
        position = end
    return b"".join(parts)


def _jpeg(data: bytes) -> bytes:
    parts, position = [data[:2]], 2
    while position + 2 <= len(data) and data[position] == _FILL:
        marker = data[position + 1]
        if marker == _EOI:
            parts.append(data[position : position + 2])
            break
        if marker == _FILL:
            position += 1
            continue
        if marker in _ALONE:
            parts.append(data[position : position + 2])
            position += 2
            continue
        end = position + 2 + int.from_bytes(data[position + 2 : position + 4], "big")
        if marker == _SOS:
            end = _scan_end(data, end)
        segment = data[position:end]
        parts.append(_application_data(marker, segment) if marker in _METADATA else segment)
        position = max(end, position + 2)
    return b"".join(parts)


def _scan_end(data: bytes, position: int) -> int:
    """Return the place of the first marker after entropy-coded data, or the end of a truncated file."""
    while (position := data.find(b"\xff", position)) >= 0 and position + 1 < len(data):
        if data[position + 1] not in _STUFFED:
            return position
        position += 2
    return len(data)


def _application_data(marker: int, segment: bytes) -> bytes:
    """Return what is kept of an application segment: what decoders need to know the colour space."""
    content = segment[4:]
    if marker == _JFIF and content.startswith(b"JFIF\0") and len(content) >= _JFIF_BYTES - 2:
        return segment[:2] + _JFIF_WITHOUT_THUMBNAIL + content[: _JFIF_BYTES - 4] + b"\0\0"
    if marker == _ADOBE and content.startswith(b"Adobe") and len(content) == _ADOBE_BYTES - 2:
        return segment
    return b""


def _sun(data: bytes) -> bytes:
    """Return a Sun raster without what follows its pixels; one with run lengths does not tell where they end."""
    if len(data) < _SUN_HEADER.size:
        raise ImageError("the file is damaged or incomplete; copy it again")
    _, width, height, depth, length, kind, _, map_length = _SUN_HEADER.unpack_from(data)
    if kind == _SUN_RUN_LENGTHS:
        return data
    row_bytes = (width * depth + 15) // 16 * 2
    return data[: _SUN_HEADER.size + map_length + max(length, row_bytes * height)]
