import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from spinewatch.detection.candidates.clusters import complete_link, silhouette


def distances(points: list[float]) -> NDArray[np.float64]:
    return np.abs(np.subtract.outer(points, points))


def test_complete_link_joins_by_the_farthest_members() -> None:
    # Single link would chain the first four before it joined the last two.
    labels = complete_link(distances([0.0, 1.0, 2.1, 3.3, 10.0, 12.9]), 3)
    assert labels[0] == labels[1] != labels[2] == labels[3]
    assert labels[4] == labels[5]


def test_samples_that_coincide_make_one_class() -> None:
    assert complete_link(np.zeros((4, 4)), 3).tolist() == [0, 0, 0, 0]


def test_silhouette_of_a_worked_example() -> None:
    # Points 0, 1 | 4: a = 1, b = 4 and 3; the sample alone in its class counts 0.
    assert silhouette(distances([0.0, 1.0, 4.0]), np.array([0, 0, 1])) == pytest.approx((3 / 4 + 2 / 3) / 3)


def test_one_class_has_no_silhouette() -> None:
    assert silhouette(distances([0.0, 1.0, 4.0]), np.zeros(3, dtype=np.intp)) == 0


@given(
    hnp.arrays(np.float64, st.integers(3, 12), elements=st.integers(-1000, 1000)),
    st.integers(2, 8),
    st.floats(0.1, 10),
)
def test_silhouette_is_bounded_and_does_not_depend_on_scale(
    points: NDArray[np.float64], count: int, scale: float
) -> None:
    distance = np.abs(np.subtract.outer(points, points))
    value = silhouette(distance, complete_link(distance, count))
    assert -1 <= value <= 1
    assert silhouette(scale * distance, complete_link(distance, count)) == pytest.approx(value, abs=1e-6)
