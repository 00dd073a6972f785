"""Small image files that cost a careless reader much, or mislead it."""

from __future__ import annotations

import struct
import zlib
from io import BytesIO
from typing import Any

import numpy as np
from PIL import Image

SIZE = (568, 416)
PNG = b"\x89PNG\r\n\x1a\n"
_LONG, _SHORT, _TEXT, _RATIONAL = 4, 3, 2, 5
Entry = tuple[int, int, bytes]


def encoded(kind: str, gray: int = 90, size: tuple[int, int] = SIZE, **options: Any) -> bytes:
    """Return a sound image of one gray level."""
    buffer = BytesIO()
    Image.fromarray(np.full(size[::-1], gray, np.uint8)).save(buffer, kind, **options)
    return buffer.getvalue()


def chunk(name: bytes, content: bytes = b"") -> bytes:
    """Return a chunk of a PNG file."""
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))


def png(*chunks: bytes, size: tuple[int, int] = SIZE, depth: int = 8) -> bytes:
    """Return a PNG file of some chunks after the first one."""
    return PNG + chunk(b"IHDR", struct.pack(">IIBBBBB", *size, depth, 0, 0, 0, 0)) + b"".join(chunks)


def pixels(size: tuple[int, int] = SIZE) -> bytes:
    """Return the chunk of black pixels of a PNG file."""
    return chunk(b"IDAT", zlib.compress(bytes((size[0] + 1) * size[1]), 9))


def value(number: int) -> bytes:
    """Return a number as the value of an entry."""
    return struct.pack("<I", number)


def tiff(changes: dict[int, Entry] | None = None, rest: bytes = b"", next_directory: int = 0) -> bytes:
    """Return a TIFF file whose entries are changed, each to its type, count and value."""
    width, height = SIZE
    entries: dict[int, Entry] = {
        256: (_SHORT, 1, value(width)),
        257: (_SHORT, 1, value(height)),
        258: (_SHORT, 1, value(8)),
        259: (_SHORT, 1, value(1)),
        262: (_SHORT, 1, value(1)),
        273: (_LONG, 1, value(8)),
        277: (_SHORT, 1, value(1)),
        278: (_SHORT, 1, value(height)),
        279: (_LONG, 1, value(width * height)),
        **(changes or {}),
    }
    listed = b"".join(
        struct.pack("<HHI", tag, *entry[:2]) + entry[2] for tag, entry in sorted(entries.items())
    )
    data = bytes(width * height) + rest
    directory = struct.pack("<H", len(entries)) + listed + struct.pack("<I", next_directory)
    return b"II*\0" + struct.pack("<I", 8 + len(data)) + data + directory


def segment(marker: int, content: bytes) -> bytes:
    """Return a segment of a JPEG file."""
    return bytes((0xFF, marker)) + struct.pack(">H", len(content) + 2) + content


def jpeg(*segments: bytes) -> bytes:
    """Return a JPEG file with some segments before the others."""
    sound = encoded("JPEG")
    return sound[:2] + b"".join(segments) + sound[2:]


def bombs() -> dict[str, bytes]:
    """Return files that no upload may take, by name."""
    n = 1_200_000
    many = bytes(4 * n)
    blocks = b"8BIM" + bytes(8)
    return {
        "TIFF of 1.2 million strips": tiff({273: (_LONG, n, value(8)), 279: (_LONG, n, value(8))}, many),
        "TIFF of 600,000 tiles": tiff({324: (_LONG, n // 2, value(8)), 325: (_LONG, n // 2, value(8))}, many),
        "TIFF of a million fractions": tiff({282: (_RATIONAL, 500_000, value(8))}, many),
        "TIFF of 65,535 entries": b"II*\0" + value(8) + struct.pack("<H", 65_535) + bytes(65_535 * 12 + 4),
        "TIFF of pages in a ring": tiff(next_directory=8 + SIZE[0] * SIZE[1]),
        "TIFF of many pages": encoded("TIFF", save_all=True, append_images=[Image.new("L", SIZE)] * 50),
        "TIFF whose orientation is text": tiff({274: (_TEXT, 4, b"abc\0")}),
        "TIFF whose width is text": tiff({256: (_TEXT, 4, b"abc\0")}),
        "TIFF whose orientation is empty": tiff({274: (_SHORT, 0, value(0))}),
        "TIFF of a huge width": tiff({256: (_LONG, 1, value(0xFFFFFFFF))}),
        "TIFF of a huge tile": tiff(
            {322: (_LONG, 1, value(1 << 30)), 323: (_LONG, 1, value(1 << 30)), 324: (_LONG, 1, value(8))}
        ),
        "TIFF without a directory": b"II*\0" + value(0xFFFFFFF0) + bytes(100),
        "PNG of 2.4 million chunks": png(chunk(b"IDAT") * 2_400_000),
        "PNG of a million texts": png(chunk(b"tEXt", b"a\0b") * 1_000_000, pixels()),
        "PNG of compressed texts": png(
            chunk(b"zTXt", b"a\0\0" + zlib.compress(bytes(1_000_000))) * 200, pixels()
        ),
        "PNG of huge size": png(pixels(), chunk(b"IEND"), size=(2_000_000, 2_000_000)),
        "PNG with a longer chunk than file": png(struct.pack(">I", 0x7FFFFFFF) + b"tEXt"),
        "PNG that moves": encoded("PNG", save_all=True, append_images=[Image.new("L", SIZE)] * 5),
        "PNG that is a ZIP file too": encoded("PNG") + b"PK\3\4" + bytes(100) + b"PK\5\6" + bytes(18),
        "PNG without pixels": png(chunk(b"IEND")),
        "JPEG of 4 million segments": b"\xff\xd8" + segment(0xE0, b"") * 4_000_000,
        "JPEG of long metadata": jpeg(segment(0xED, (b"Photoshop 3.0\0" + blocks * 5460)[:65_000]) * 40),
        "JPEG of garbage": b"\xff\xd8" + b"\xff\x00" * 5_000_000,
        "JPEG of filling": b"\xff\xd8" + b"\xff" * 10_000_000,
        "JPEG of 10,000 scans": jpeg() + segment(0xDA, b"\1\1\0\0?\0") * 10_000,
        "JPEG of huge size": encoded("JPEG").replace(
            struct.pack(">HH", SIZE[1], SIZE[0]), struct.pack(">HH", 65_000, 65_000)
        ),
        "Sun raster of huge size": struct.pack(">8I", 0x59A66A95, 1 << 31, 1 << 31, 8, 0, 1, 0, 0),
        "Sun raster of 8 bytes": struct.pack(">2I", 0x59A66A95, 568),
        "another format that is not allowed": b"GIF89a" + bytes(1000),
    }
