import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.detection.candidates.surgical_field import (
    FieldParameters,
    SurgicalField,
    modes,
    segment_statistics,
    surgical_field,
    threshold,
)


@given(st.integers(1, 60), st.integers(1, 60), st.integers(0, 1), st.integers(1, 9))
def test_segment_statistics_are_means_and_deviations_of_runs_of_lines(
    height: int, width: int, axis: int, size: int
) -> None:
    image = np.random.default_rng(height * 61 + width).uniform(0, 255, (height, width))
    mean, deviation = segment_statistics(image, axis, size)
    lines = image if axis == 0 else image.T
    runs = [lines[i : i + size] for i in range(0, len(lines), size)]
    assert np.allclose(mean, [run.mean() for run in runs])
    assert np.allclose(deviation, [run.std() for run in runs], atol=1e-6)


def test_threshold_and_modes_follow_equation_4_3() -> None:
    statistic = np.array([1.0, 5, 9, 9, 2, 7, 1])
    assert threshold(statistic, 0.5) == 5
    assert modes(statistic, 5) == [(2, 4), (5, 6)]


def test_the_field_surrounds_the_busy_part_with_a_margin() -> None:
    busy = np.full((200, 300), 1.0)
    busy[80:130, 60:240] = 10.0
    field = surgical_field(busy, FieldParameters())
    assert field.u0 <= 50
    assert field.u1 >= 250
    assert 40 <= field.v0 <= 70
    assert 140 <= field.v1 <= 170


def test_an_even_image_is_field_all_over() -> None:
    assert surgical_field(np.ones((50, 70)), FieldParameters()) == SurgicalField(0, 0, 70, 50)
