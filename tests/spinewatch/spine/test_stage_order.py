import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.spine.motion import ReferenceMissingError
from spinewatch.spine.stage_order import BaselineMissingError, comparisons, require_baseline
from spinewatch.triads.pose import Pose

POSE = Pose(np.zeros(3), np.eye(3), np.eye(6))


def test_the_baseline_is_the_first_stage_even_without_the_reference() -> None:
    found = comparisons("A", [("A", False), ("B", True), ("C", False), ("D", True), ("E", True)])
    assert [item.baseline for item in found] == ["A"] * 5
    assert [item.previous for item in found] == [None, None, "B", "B", "D"]


def test_the_baseline_is_the_first_stage_even_without_a_result() -> None:
    found = comparisons("A", [("B", True), ("C", True)])
    assert [(item.baseline, item.previous) for item in found] == [("A", None), ("A", "B")]


def test_a_named_baseline_is_kept_even_when_it_has_no_result() -> None:
    found = comparisons("A", [("A", True), ("B", True)], "C")
    assert [(item.baseline, item.previous) for item in found] == [("C", None), ("C", "A")]


def test_without_any_measured_stage_there_is_nothing_to_compare() -> None:
    assert comparisons("A", []) == ()


@given(st.lists(st.booleans(), max_size=8))
def test_the_stage_before_comes_before_and_has_the_reference(references: list[bool]) -> None:
    stages = [(str(number), has) for number, has in enumerate(references)]
    for number, item in enumerate(comparisons("0", stages)):
        earlier = [name for name, has in stages[:number] if has]
        assert item.previous == (earlier[-1] if earlier else None)


def test_a_baseline_must_have_a_result_and_the_reference() -> None:
    require_baseline("PRE", "L1", {"L1": POSE})
    with pytest.raises(
        BaselineMissingError, match=r"stage PRE has no result; .* as the baseline in the setup"
    ):
        require_baseline("PRE", "L1", None)
    with pytest.raises(
        ReferenceMissingError, match=r"L1 has no pose in the baseline stage PRE; label it there"
    ):
        require_baseline("PRE", "L1", {"T9": POSE})
