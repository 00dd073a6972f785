from dataclasses import replace

import numpy as np

from spinewatch.imaging.filters import truncated_median_filter
from spinewatch.thesis_1995.preprocessing import (
    PreprocessingParameters,
    SegmentStatistic,
    preprocess,
    segment_statistics,
)

PUBLISHED = PreprocessingParameters()


def wound_between_drapes() -> np.ndarray:
    """An image of 416 rows: drapes of one gray level, and a dark wound with balls in rows 150 to 250."""
    image = np.full((416, 568), 120, np.float32)
    image[150:250] = 30
    image[150:250, ::11] = 90
    return image


def test_both_gamma_corrections_are_applied_to_a_bright_image_too() -> None:
    bright = np.full((20, 30), 200, np.float32)
    bright[::2] = 180
    image = preprocess(bright, replace(PUBLISHED, statistic=None)).gray
    expected = 255 * (bright / 255) ** (1 / 3)
    assert np.allclose(image, truncated_median_filter(expected.astype(np.float32)), atol=1e-3)


def test_an_image_of_416_rows_has_83_segments_of_five_rows_and_one_of_one() -> None:
    statistics = segment_statistics(np.zeros((416, 568), np.float32), 5)
    assert len(statistics.means) == 84
    assert statistics.first_rows[-2:] == [415, 416]


def test_the_field_is_the_mode_of_the_greatest_spread() -> None:
    image = wound_between_drapes()
    image[300:310, ::5] = 90  # a weaker second mode
    assert preprocess(image, PUBLISHED).rows == (150, 250)


def test_by_means_the_field_is_the_darkest_mode() -> None:
    assert preprocess(wound_between_drapes(), replace(PUBLISHED, statistic=SegmentStatistic.MEAN)).rows == (
        150,
        250,
    )


def test_edges_are_those_of_the_filtered_field() -> None:
    found = preprocess(wound_between_drapes(), PUBLISHED)
    assert found.gray.shape == found.edges.shape == (100, 568)
