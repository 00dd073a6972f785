"""Headers of image files are read without decoding, or refused with a reason."""

from __future__ import annotations

import struct
import time
import zlib
from io import BytesIO
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image, TiffImagePlugin, TiffTags

from spinewatch.errors import ImageError
from spinewatch.imaging.header import MAX_PIXELS, inspect_image
from tests.image_bombs import bombs

GRAY = np.random.default_rng(7).integers(0, 256, (40, 64), dtype=np.uint8)


def encoded(image: Image.Image, kind: str, **options: Any) -> bytes:
    buffer = BytesIO()
    image.save(buffer, kind, **options)
    return buffer.getvalue()


def opencv(extension: str, array: np.ndarray[Any, Any]) -> bytes:
    ok, data = cv2.imencode(extension, array)
    assert ok
    return data.tobytes()


@pytest.mark.parametrize(
    ("kind", "media_type"),
    [("PNG", "image/png"), ("TIFF", "image/tiff"), ("JPEG", "image/jpeg"), ("SUN", "image/x-sun-raster")],
)
def test_header_names_kind_and_size(kind: str, media_type: str) -> None:
    data = opencv(".ras", GRAY) if kind == "SUN" else encoded(Image.fromarray(GRAY), kind)
    header = inspect_image(data)
    assert (header.kind, header.media_type, header.width, header.height) == (kind, media_type, 64, 40)


def test_enormous_header_is_refused_without_decoding() -> None:
    def chunk(name: bytes, content: bytes) -> bytes:
        return (
            struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))
        )

    header = struct.pack(">IIBBBBB", 60_000, 60_000, 8, 0, 0, 0, 0)
    with pytest.raises(ImageError, match="million pixels"):
        inspect_image(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", b""))


def test_pixel_limit_is_exact() -> None:
    def sun(width: int, height: int) -> bytes:
        return struct.pack(">8I", 0x59A66A95, width, height, 8, width * height, 1, 0, 0)

    assert inspect_image(sun(MAX_PIXELS // 8000, 8000)).width == MAX_PIXELS // 8000
    with pytest.raises(ImageError, match="million pixels"):
        inspect_image(sun(MAX_PIXELS // 8000, 8001))


@pytest.mark.parametrize("kind", ["PNG", "TIFF"])
def test_several_images_are_refused(kind: str) -> None:
    pages = [Image.fromarray(GRAY), Image.fromarray(255 - GRAY)]
    data = encoded(pages[0], kind, save_all=True, append_images=pages[1:])
    with pytest.raises(ImageError, match="several"):
        inspect_image(data)


@pytest.mark.parametrize("mode", ["F", "I"])
def test_samples_of_32_bits_are_refused(mode: str) -> None:
    with pytest.raises(ImageError, match="32-bit"):
        inspect_image(encoded(Image.fromarray(GRAY).convert(mode), "TIFF"))


def test_signed_samples_are_refused() -> None:
    tags = [
        (256, 4),
        (257, 1),
        (258, 16),
        (259, 1),
        (262, 1),
        (273, 8),
        (277, 1),
        (278, 1),
        (279, 8),
        (339, 2),
    ]
    directory = b"".join(struct.pack("<HHII", tag, 3, 1, value) for tag, value in tags)
    data = b"II*\0" + struct.pack("<I", 16) + bytes(8) + struct.pack("<H", len(tags)) + directory + bytes(4)
    with pytest.raises(ImageError, match="signed"):
        inspect_image(data)


def test_other_formats_are_refused() -> None:
    for kind in ("GIF", "BMP", "PPM"):
        with pytest.raises(ImageError, match="not a PNG"):
            inspect_image(encoded(Image.fromarray(GRAY), kind))
    with pytest.raises(ImageError, match="empty"):
        inspect_image(b"")


@pytest.mark.parametrize("data", bombs().values(), ids=bombs())
def test_a_bomb_is_refused_in_milliseconds(data: bytes) -> None:
    before = time.process_time()
    with pytest.raises(ImageError):
        inspect_image(data)
    assert time.process_time() - before < 0.1


@pytest.mark.parametrize("value", [b"\x06", b"\x06\x06"])
def test_an_orientation_that_is_no_number_is_refused(value: bytes) -> None:
    tags = TiffImagePlugin.ImageFileDirectory_v2()
    tags.tagtype[274] = TiffTags.BYTE
    tags[274] = value
    buffer = BytesIO()
    Image.new("L", (20, 12)).save(buffer, "TIFF", tiffinfo=tags)
    with pytest.raises(ImageError, match="orientation"):
        inspect_image(buffer.getvalue())
