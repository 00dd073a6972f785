import numpy as np
import pytest

from spinewatch.imaging.comparison import TexturedStrip, may_be_equal, textured_strip
from workers.strips import packed, unpacked


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_a_strip_is_read_as_it_was_stored(dtype: type[np.unsignedinteger]) -> None:
    image = np.random.default_rng(1).integers(0, np.iinfo(dtype).max, (150, 211), dtype)
    strip = textured_strip(image)
    assert strip is not None
    again = unpacked(packed(strip))
    assert isinstance(again, TexturedStrip)
    assert (again.place, again.image_shape) == (strip.place, (150, 211))
    assert again.pixels.dtype == dtype
    assert may_be_equal(again, image)
    assert unpacked(packed(strip)[:-1]) is None


@pytest.mark.parametrize("content", [b"", b"0" * 16, b"0" * 200, bytes(200)])
def test_a_damaged_strip_is_none(content: bytes) -> None:
    assert unpacked(content) is None
