from typing import Any

import numpy as np
from hypothesis import given
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from spinewatch.imaging.filters import truncated_median_filter

images = hnp.arrays(np.uint8, hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=12))


def truncated_median_of_nine(values: NDArray[Any]) -> float:
    """The filter's definition for one neighbourhood, written out."""
    s = np.sort(np.asarray(values, dtype=np.float64))[1:8]
    reach = min(s[3] - s[0], s[6] - s[3])
    return float(np.median(s[(s >= s[3] - reach) & (s <= s[3] + reach)]))


@given(images)
def test_truncated_median_follows_its_definition_at_every_pixel(image: NDArray[Any]) -> None:
    filtered = truncated_median_filter(image.astype(np.float32))
    padded = np.pad(image, 1, mode="edge")
    for (v, u), value in np.ndenumerate(filtered):
        assert value == truncated_median_of_nine(padded[v : v + 3, u : u + 3].ravel())


def test_truncated_median_sharpens_a_blurred_edge_without_moving_it() -> None:
    edge = np.tile(np.array([0, 0, 0, 60, 200, 255, 255, 255], dtype=np.float32), (8, 1))
    filtered = truncated_median_filter(edge)
    assert filtered[4, 3] <= 60
    assert filtered[4, 4] >= 200


def test_truncated_median_removes_an_impulse() -> None:
    image = np.full((7, 7), 50, dtype=np.float32)
    image[3, 3] = 255
    assert np.all(truncated_median_filter(image) == 50)
