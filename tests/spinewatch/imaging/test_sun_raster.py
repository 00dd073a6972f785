"""Sun rasters with run lengths are decoded at odd widths too."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from spinewatch.errors import ImageError
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.sun_raster import decode_padded_runs, encode_sun_raster, has_padded_runs

RNG = np.random.default_rng(5)
GRAY = np.repeat(RNG.choice(np.array([0, 7, 128, 129, 255], np.uint8), (12, 11)), 3, axis=1)
RED, GREEN, BLUE = 0.299, 0.587, 0.114


def packed(rows: NDArray[np.uint8]) -> bytes:
    """Return rows (H, bytes) with run lengths, padded to 16 bits before."""
    data = np.pad(rows, ((0, 0), (0, rows.shape[1] % 2))).tobytes()
    out, position = bytearray(), 0
    while position < len(data):
        value, run = data[position], 1
        while run < 256 and data[position + run : position + run + 1] == bytes((value,)):
            run += 1
        if run > 2 or value == 0x80:
            out += bytes((0x80, run - 1, value)) if run > 1 else bytes((0x80, 0))
        else:
            out += bytes((value,)) * run
        position += run
    return bytes(out)


def raster(rows: NDArray[np.uint8], width: int, depth: int = 8, colours: bytes = b"") -> bytes:
    body = packed(rows)
    kind = 1 if colours else 0
    return (
        struct.pack(">8I", 0x59A66A95, width, len(rows), depth, len(body), 2, kind, len(colours))
        + colours
        + body
    )


def luma(red: Any, green: Any, blue: Any) -> NDArray[Any]:
    return np.asarray(np.rint(RED * red + GREEN * green + BLUE * blue))


def test_gray_at_an_odd_width() -> None:
    data = raster(GRAY, GRAY.shape[1])
    assert has_padded_runs(data)
    np.testing.assert_array_equal(decode_image(data), GRAY)


def test_even_widths_are_left_to_pillow() -> None:
    even = GRAY[:, :-1]
    data = raster(even, even.shape[1])
    assert not has_padded_runs(data)
    np.testing.assert_array_equal(decode_image(data), even)


def test_colour_becomes_luma() -> None:
    bgr = RNG.integers(0, 256, (6, 5, 3), dtype=np.uint8)
    data = raster(bgr.reshape(6, 15), 5, depth=24)
    expected = luma(*(bgr[..., channel].astype(float) for channel in (2, 1, 0)))
    np.testing.assert_array_equal(decode_padded_runs(data), expected)


def test_colour_map_is_applied() -> None:
    colours = RNG.integers(0, 256, (3, 256), dtype=np.uint8)
    data = raster(GRAY, GRAY.shape[1], colours=colours.tobytes())
    expected = luma(*colours.astype(float))[GRAY]
    np.testing.assert_array_equal(decode_padded_runs(data), expected)


@pytest.mark.parametrize("part", [0.3, 0.8])
def test_truncated_runs_are_refused(part: float) -> None:
    data = raster(GRAY, GRAY.shape[1])
    with pytest.raises(ImageError, match="incomplete"):
        decode_image(data[: int(len(data) * part)])


def test_other_depths_are_refused() -> None:
    data = bytearray(raster(GRAY, GRAY.shape[1]))
    data[12:16] = struct.pack(">I", 1)
    with pytest.raises(ValueError, match="bits"):
        decode_padded_runs(bytes(data))


@pytest.mark.parametrize("width", [1, 8, 11])
def test_a_written_raster_is_read_back(width: int) -> None:
    image = RNG.integers(0, 256, (5, width)).astype(np.uint8)
    assert np.array_equal(decode_image(encode_sun_raster(image)), image)
