"""PNG files are complete to their last byte, or refused."""

from __future__ import annotations

import struct
import zlib
from io import BytesIO
from typing import Any

import cv2
import numpy as np
import pytest
from PIL import Image

from spinewatch.errors import ImageError
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.png_stream import are_rows_complete, require_complete_rows
from tests.image_bombs import PNG, SIZE, chunk, encoded, pixels, png

RANDOM = np.random.default_rng(5)
GRAY = RANDOM.integers(0, 256, SIZE[::-1], dtype=np.uint8)
END = chunk(b"IEND")
ADAM7 = ((0, 8, 0, 8), (4, 8, 0, 8), (0, 4, 4, 8), (2, 4, 0, 4), (0, 2, 2, 4), (1, 2, 0, 2), (0, 1, 1, 2))


def saved(image: Image.Image, **options: Any) -> bytes:
    buffer = BytesIO()
    image.save(buffer, "PNG", **options)
    return buffer.getvalue()


def rows(count: int, after: bytes = b"") -> bytes:
    """Return a PNG file with some rows of noise in a sound stream, whatever its header says."""
    raw = b"".join(b"\0" + row.tobytes() for row in np.resize(GRAY, (count, SIZE[0])))
    return png(chunk(b"IDAT", zlib.compress(raw) + after), END)


def interlaced(gray: np.ndarray[Any, Any], surplus: int = 0) -> bytes:
    """Return a PNG file of 8 bits with the passes of Adam7."""
    height, width = gray.shape
    passes = (gray[row::row_step, column::step] for column, step, row, row_step in ADAM7)
    raw = b"".join(b"\0" + row.tobytes() for one in passes if one.size for row in one)
    raw = raw[:surplus] if surplus < 0 else raw + bytes(surplus)
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 1))
    return PNG + header + chunk(b"IDAT", zlib.compress(raw)) + END


def encoded_by_opencv() -> bytes:
    ok, data = cv2.imencode(".png", GRAY)
    assert ok
    return bytes(data)


@pytest.mark.parametrize(
    "data",
    [
        saved(Image.fromarray(GRAY)),
        saved(Image.fromarray(GRAY), compress_level=0),
        saved(Image.fromarray(GRAY).convert("RGB")),
        saved(Image.fromarray(GRAY).convert("RGBA"), optimize=True),
        saved(Image.fromarray(GRAY).convert("LA")),
        saved(Image.fromarray(GRAY[:, :101] > 99)),
        saved(Image.fromarray(GRAY[:, :101]).quantize(4), bits=2),
        saved(Image.fromarray(GRAY.astype(np.uint16) * 257)),
        encoded_by_opencv(),
        encoded("PNG"),
        encoded("PNG", size=(3000, 2000)),
        encoded("PNG") + bytes(100),
        saved(Image.fromarray(GRAY), dpi=(300, 300)),
        png(chunk(b"IDAT"), pixels(), chunk(b"IDAT"), chunk(b"tEXt", b"a\0b"), END),
    ],
    ids=[
        *("gray", "stored", "colour", "transparent", "gray transparent", "one bit", "two bits", "deep"),
        *("opencv", "flat", "large", "filled", "described", "empty chunks"),
    ],
)
def test_sound_files_are_complete(data: bytes) -> None:
    assert are_rows_complete(data)


@pytest.mark.parametrize("size", [(1, 1), (2, 3), (3, 2), (4, 5), (5, 4), (9, 17), (64, 40)])
def test_interlaced_files(size: tuple[int, int]) -> None:
    gray = GRAY[: size[1], : size[0]]
    np.testing.assert_array_equal(decode_image(interlaced(gray)), gray)
    for surplus in (-1, 1):
        assert not are_rows_complete(interlaced(gray, surplus))


@pytest.mark.parametrize("count", [0, 1, 320, 400, SIZE[1] - 1, SIZE[1] + 1, 2 * SIZE[1]])
def test_missing_and_surplus_rows_are_refused(count: int) -> None:
    np.testing.assert_array_equal(decode_image(rows(SIZE[1])), GRAY)
    with pytest.raises(ImageError, match="damaged or incomplete"):
        decode_image(rows(count))


def test_every_cut_is_refused() -> None:
    data = saved(Image.fromarray(GRAY))
    for missing in (*range(1, 40), 1000):
        assert not are_rows_complete(data[:-missing]), missing


def test_data_after_the_rows_are_refused() -> None:
    assert not are_rows_complete(rows(SIZE[1], b"x"))
    whole = rows(SIZE[1]).removesuffix(END)
    assert are_rows_complete(whole + END)
    assert not are_rows_complete(whole + chunk(b"IDAT", b"x") + END)


@pytest.mark.parametrize("place", [20, 40, 1000, -14, -18, -3])
def test_a_changed_bit_anywhere_is_seen(place: int) -> None:
    data = bytearray(saved(Image.fromarray(GRAY)))
    data[place] ^= 1
    assert not are_rows_complete(bytes(data))


def test_a_wrong_checksum_of_the_rows_in_sound_chunks_is_seen() -> None:
    stream = zlib.compress(bytes((SIZE[0] + 1) * SIZE[1]))
    assert are_rows_complete(png(chunk(b"IDAT", stream), END))
    assert not are_rows_complete(png(chunk(b"IDAT", stream[:-1] + bytes((stream[-1] ^ 1,))), END))


def test_data_chunks_must_follow_each_other() -> None:
    stream = zlib.compress(bytes((SIZE[0] + 1) * SIZE[1]))
    first, second = chunk(b"IDAT", stream[:50]), chunk(b"IDAT", stream[50:])
    assert are_rows_complete(png(first, second, END))
    assert not are_rows_complete(png(first, chunk(b"tEXt", b"a\0b"), second, END))


def test_what_has_no_rows_or_no_colour_type_is_refused() -> None:
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", 2, 1, 8, 5, 0, 0, 0))
    for data in (png(END), PNG, PNG + header + chunk(b"IDAT", zlib.compress(bytes(3))) + END):
        with pytest.raises(ImageError, match="copy it again"):
            require_complete_rows(data)
