"""Images are decoded as the sensor stored them, or refused with a reason."""

from __future__ import annotations

import struct
from io import BytesIO
from typing import Any

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from spinewatch.errors import ImageError
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.header import inspect_image
from tests.tiff_files import tiff

GRAY = np.random.default_rng(7).integers(0, 256, (40, 64), dtype=np.uint8)
GRAY16 = GRAY.astype(np.uint16) * 256 + 17
ORIENTATION = 274


def encoded(image: Image.Image, kind: str, **options: Any) -> bytes:
    buffer = BytesIO()
    image.save(buffer, kind, **options)
    return buffer.getvalue()


def opencv(extension: str, array: np.ndarray[Any, Any]) -> bytes:
    ok, data = cv2.imencode(extension, array)
    assert ok
    return data.tobytes()


LOSSLESS = {
    "png": encoded(Image.fromarray(GRAY), "PNG"),
    "png with transparency": encoded(Image.fromarray(GRAY).convert("LA"), "PNG"),
    "png colour": encoded(Image.fromarray(GRAY).convert("RGB"), "PNG"),
    "png colour with transparency": encoded(Image.fromarray(GRAY).convert("RGBA"), "PNG"),
    "png palette": encoded(Image.fromarray(GRAY).convert("P"), "PNG"),
    "png palette with transparency": encoded(Image.fromarray(GRAY).convert("P"), "PNG", transparency=3),
    "tiff": encoded(Image.fromarray(GRAY), "TIFF"),
    "tiff lzw": encoded(Image.fromarray(GRAY), "TIFF", compression="tiff_lzw"),
    "sun raster": opencv(".ras", GRAY),
    "sun raster colour": opencv(".ras", cv2.merge([GRAY] * 3)),
}


@pytest.mark.parametrize("data", LOSSLESS.values(), ids=LOSSLESS.keys())
def test_lossless_kinds_keep_every_gray_level(data: bytes) -> None:
    image = decode_image(data)
    assert image.dtype == np.uint8
    np.testing.assert_array_equal(image, GRAY)
    assert image.flags.c_contiguous


@pytest.mark.parametrize("extension", [".png", ".tiff"])
def test_sixteen_bits_are_kept(extension: str) -> None:
    image = decode_image(opencv(extension, GRAY16))
    assert image.dtype == np.uint16
    assert image.dtype.isnative
    np.testing.assert_array_equal(image, GRAY16)


def test_big_endian_tiff_is_kept() -> None:
    rows = GRAY16.astype(">u2").tobytes()
    height, width = GRAY16.shape
    tags = [
        (256, width),
        (257, height),
        (258, 16),
        (259, 1),
        (262, 1),
        (273, 8),
        (278, height),
        (279, len(rows)),
    ]
    directory = b"".join(struct.pack(">HHII", tag, 4, 1, value) for tag, value in tags)
    offset = 8 + len(rows)
    data = b"MM\0*" + struct.pack(">I", offset) + rows + struct.pack(">H", len(tags)) + directory + bytes(4)
    np.testing.assert_array_equal(decode_image(data), GRAY16)


def test_jpeg_is_close() -> None:
    smooth = np.add.outer(np.arange(40), np.arange(64)).astype(np.uint8)
    image = decode_image(encoded(Image.fromarray(smooth), "JPEG", quality=95))
    assert np.abs(image.astype(int) - smooth).max() <= 2


def test_one_bit_becomes_black_and_white() -> None:
    image = decode_image(encoded(Image.fromarray(GRAY > 127), "PNG"))
    np.testing.assert_array_equal(image, np.where(GRAY > 127, 255, 0))


def test_colour_becomes_luma() -> None:
    rgb = np.random.default_rng(3).integers(0, 256, (9, 11, 3), dtype=np.uint8)
    image = decode_image(encoded(Image.fromarray(rgb), "PNG"))
    np.testing.assert_allclose(image, rgb @ [0.299, 0.587, 0.114], atol=0.51)


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("kind", ["PNG", "TIFF", "JPEG"])
def test_orientation_tag_is_ignored(kind: str, orientation: int) -> None:
    plain = Image.fromarray(GRAY)
    exif = Image.Exif()
    exif[ORIENTATION] = orientation
    tag = {"tiffinfo": {ORIENTATION: orientation}} if kind == "TIFF" else {"exif": exif}
    data = encoded(plain, kind, **tag)
    assert Image.open(BytesIO(data)).getexif()[ORIENTATION] == orientation
    assert inspect_image(data).size == (64, 40)
    np.testing.assert_array_equal(decode_image(data), decode_image(encoded(plain, kind)))


@pytest.mark.parametrize("data", LOSSLESS.values(), ids=LOSSLESS.keys())
@pytest.mark.parametrize("part", [0.1, 0.6, 0.97])
def test_truncated_file_is_refused(data: bytes, part: float) -> None:
    with pytest.raises(ImageError, match=r"damaged|incomplete"):
        decode_image(data[: int(len(data) * part)])


def test_truncated_jpeg_is_refused() -> None:
    data = encoded(Image.fromarray(GRAY), "JPEG")
    with pytest.raises(ImageError, match="incomplete"):
        decode_image(data[: len(data) * 2 // 3])


@given(st.sampled_from(sorted(LOSSLESS)), st.data())
def test_damage_is_refused_by_name_or_decoded_to_an_image(kind: str, data: st.DataObject) -> None:
    damaged = bytearray(LOSSLESS[kind])
    for position in data.draw(st.lists(st.integers(0, len(damaged) - 1), max_size=8)):
        damaged[position] ^= data.draw(st.integers(1, 255))
    try:
        image = decode_image(bytes(damaged))
    except ImageError:
        return
    assert image.ndim == 2
    assert image.dtype in (np.uint8, np.uint16)


def tiff16(image: np.ndarray[Any, Any], photometric: int) -> bytes:
    """Return a little-endian TIFF of 16 bits; photometric 0: white is zero."""
    height, width = image.shape
    rows = image.astype("<u2").tobytes()
    tags = [
        (256, width),
        (257, height),
        (258, 16),
        (259, 1),
        (262, photometric),
        (273, 8),
        (277, 1),
        (278, height),
        (279, len(rows)),
    ]
    directory = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags)
    return (
        b"II*\0"
        + struct.pack("<I", 8 + len(rows))
        + rows
        + struct.pack("<H", len(tags))
        + directory
        + bytes(4)
    )


def test_white_as_zero_is_inverted_in_tiffs_of_sixteen_bits() -> None:
    np.testing.assert_array_equal(decode_image(tiff16(65535 - GRAY16, 0)), GRAY16)
    np.testing.assert_array_equal(decode_image(tiff16(GRAY16, 1)), GRAY16)


@pytest.mark.parametrize("extension", [".png", ".tiff"])
def test_colour_of_sixteen_bits_keeps_its_depth(extension: str) -> None:
    twelve = GRAY16 >> 4
    image = decode_image(opencv(extension, cv2.merge([twelve] * 3)))
    assert image.dtype == np.uint16
    np.testing.assert_array_equal(image, twelve)


COLOUR16 = np.stack([GRAY16 >> 4] * 3, axis=-1)


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("compression", [1, 8])
def test_planes_of_sixteen_bit_colour_are_refused_by_name(order: Any, compression: int) -> None:
    with pytest.raises(ImageError, match="16-bit colour in planes one after the other"):
        decode_image(tiff(COLOUR16, 16, planar=2, order=order, compression=compression))


@pytest.mark.parametrize("orientation", range(2, 9))
def test_sixteen_bit_colour_with_an_orientation_is_refused_by_name(orientation: int) -> None:
    with pytest.raises(ImageError, match="16-bit colour and an orientation tag"):
        decode_image(tiff(COLOUR16, 16, orientation=orientation))


@pytest.mark.parametrize("orientation", range(1, 9))
def test_sixteen_bits_keep_their_depth_with_an_orientation(orientation: int) -> None:
    np.testing.assert_array_equal(decode_image(tiff(GRAY16, 16, orientation=orientation)), GRAY16)


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize("planar", [1, 2])
def test_colour_of_eight_bits_is_read_in_every_layout(planar: int, orientation: int) -> None:
    data = tiff(np.stack([GRAY] * 3, axis=-1), 8, planar=planar, orientation=orientation)
    np.testing.assert_array_equal(decode_image(data), GRAY)
