import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.imaging.pyramid import reduce_image


@given(st.integers(1, 20), st.integers(1, 20), st.integers(1, 5))
def test_every_pixel_is_the_mean_of_its_block(height: int, width: int, factor: int) -> None:
    gray = np.random.default_rng(height * 21 + width).uniform(0, 255, (height, width)).astype(np.float32)
    small = reduce_image(gray, factor)
    assert small.shape == (height // factor, width // factor)
    for (v, u), value in np.ndenumerate(small):
        block = gray[v * factor : (v + 1) * factor, u * factor : (u + 1) * factor]
        assert value == pytest.approx(block.mean(), abs=1e-3)


def test_the_centre_of_a_block_is_where_a_ramp_has_its_value() -> None:
    ramp = np.tile(np.arange(12, dtype=np.float32), (6, 1))
    assert reduce_image(ramp, 3)[0] == pytest.approx(3 * np.arange(4) + 1)


def test_a_factor_of_one_changes_nothing() -> None:
    gray = np.ones((3, 4), np.float32)
    assert reduce_image(gray, 1) is gray
