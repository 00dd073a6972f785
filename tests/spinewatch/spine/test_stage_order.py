from hypothesis import given
from hypothesis import strategies as st

from spinewatch.spine.stage_order import comparisons


def test_the_baseline_is_the_first_stage_with_the_reference() -> None:
    found = comparisons([("A", False), ("B", True), ("C", False), ("D", True), ("E", True)])
    assert [item.baseline for item in found] == ["B"] * 5
    assert [item.previous for item in found] == [None, None, "B", "B", "D"]


def test_a_named_baseline_is_kept_even_when_it_has_no_result() -> None:
    found = comparisons([("A", True), ("B", True)], "C")
    assert [(item.baseline, item.previous) for item in found] == [("C", None), ("C", "A")]


def test_without_any_reference_there_is_no_baseline() -> None:
    assert [item.baseline for item in comparisons([("A", False)])] == [None]
    assert comparisons([]) == ()


@given(st.lists(st.booleans(), max_size=8))
def test_the_stage_before_comes_before_and_has_the_reference(references: list[bool]) -> None:
    stages = [(str(number), has) for number, has in enumerate(references)]
    for number, item in enumerate(comparisons(stages)):
        earlier = [name for name, has in stages[:number] if has]
        assert item.previous == (earlier[-1] if earlier else None)
