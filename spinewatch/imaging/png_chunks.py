"""The chunks of a PNG file, walked under limits before a decoder reads them."""

from __future__ import annotations

from spinewatch.errors import ImageError

SIGNATURE = b"\x89PNG\r\n\x1a\n"
"""The first bytes of a PNG file."""

_MAX_CHUNKS = 8192
_MAX_ANCILLARY = 256
_MAX_COMPRESSED = 16
_MAX_ANCILLARY_BYTES = 1 << 20
_OVERHEAD = 12
_HEADER_BYTES = 13
_COMPRESSED = frozenset({b"iCCP", b"iTXt", b"zTXt"})
_ANIMATION = frozenset({b"acTL", b"fcTL", b"fdAT"})
_DAMAGED = "the PNG file is damaged or incomplete; copy it again"
_TOO_MANY = "the PNG file has too many chunks or too long ones; export it again, without metadata"


def png_size(data: bytes) -> tuple[int, int]:
    """Return the size of a PNG file that can be read at a bounded cost.

    Parameters
    ----------
    data
        Contents of a file that begins with `SIGNATURE`.

    Returns
    -------
    tuple of int
        Width and height, px.

    Raises
    ------
    ImageError
        If the file has more or longer chunks than any camera writes, several images, no image, or something after its
        image.

    References
    ----------
    W3C PNG specification, third edition, sections 5.3 (chunks) and 11.2.1 (IHDR).
    """
    width = height = count = ancillary = ancillary_bytes = compressed = 0
    has_pixels = False
    position = len(SIGNATURE)
    while True:
        length, name = int.from_bytes(data[position : position + 4], "big"), data[position + 4 : position + 8]
        if len(name) < 4 and has_pixels:
            break  # a truncated image is found when it is decoded
        if len(name) < 4 or (count == 0) != (name == b"IHDR"):
            raise ImageError(_DAMAGED)
        if name == b"IHDR":
            if length != _HEADER_BYTES:
                raise ImageError(_DAMAGED)
            width = int.from_bytes(data[position + 8 : position + 12], "big")
            height = int.from_bytes(data[position + 12 : position + 16], "big")
        elif name == b"IEND":
            if not has_pixels:
                raise ImageError(_DAMAGED)
            if data[position + _OVERHEAD :].strip(b"\0"):
                raise ImageError("the PNG file has further data after its image; export it again")
            break
        elif name in _ANIMATION:
            raise ImageError("the file holds several images; send one image per file")
        elif name == b"IDAT":
            has_pixels = True
        else:
            ancillary += 1
            ancillary_bytes += length
            compressed += name in _COMPRESSED
        count += 1
        if (
            count > _MAX_CHUNKS
            or ancillary > _MAX_ANCILLARY
            or ancillary_bytes > _MAX_ANCILLARY_BYTES
            or compressed > _MAX_COMPRESSED
        ):
            raise ImageError(_TOO_MANY)
        position += length + _OVERHEAD
    return width, height
