import numpy as np
import pytest

from spinewatch.errors import ImageError
from spinewatch.imaging.frame import Frame


def test_a_frame_gives_its_size_and_new_gray_levels() -> None:
    pixels = np.arange(6, dtype=np.uint8).reshape(2, 3)
    frame = Frame(pixels, "right")
    assert frame.size_px == (3, 2)
    gray = frame.gray()
    assert gray.dtype == np.float32
    gray += 1
    np.testing.assert_array_equal(frame.gray(), pixels)


def test_pixels_of_another_type_are_refused() -> None:
    with pytest.raises(ImageError, match="8 or 16 bits"):
        Frame(np.zeros((4, 4), np.float64), "left").gray()  # type: ignore[arg-type]
