import numpy as np
import pytest

from spinewatch.imaging.comparison import TexturedStrip, may_be_equal, textured_strip
from workers.strips import packed, unpacked


def some(dtype: type[np.unsignedinteger]) -> TexturedStrip:
    image = np.random.default_rng(1).integers(0, np.iinfo(dtype).max, (150, 211), dtype)
    strip = textured_strip(image)
    assert strip is not None
    assert may_be_equal(strip, image)
    return strip


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_a_strip_is_read_as_it_was_stored(dtype: type[np.unsignedinteger]) -> None:
    strip = some(dtype)
    again = unpacked(packed(strip))
    assert again is not None
    assert (again.row, again.white, again.image_shape) == (strip.row, strip.white, (150, 211))
    assert again.pixels.dtype == dtype
    assert np.array_equal(again.pixels, strip.pixels)


@pytest.mark.parametrize("content", [b"", b"0" * 22, bytes(22), bytes(23), b"0" * 200])
def test_what_is_no_strip_is_none(content: bytes) -> None:
    assert unpacked(content) is None


@pytest.mark.parametrize("byte", [0, 4, 8, 12, 16, 20, 22, 23, 5000])
def test_a_strip_with_one_damaged_bit_is_none(byte: int) -> None:
    stored = bytearray(packed(some(np.uint16)))
    stored[byte] ^= 1
    assert unpacked(bytes(stored)) is None
    assert unpacked(packed(some(np.uint16))[:-1]) is None
