from reports.headlines import headlines
from tests.contract.spine_results import stage_spine


def test_headlines_give_both_ends_and_the_change_with_intervals() -> None:
    cobb, rotation = headlines(
        stage_spine(0), stage_spine(2), "curve 1", ("cobb-fixed", "apical-rotation", "ferguson")
    )
    assert cobb.after is not None
    assert cobb.change is not None
    assert rotation.change is not None
    assert (cobb.before.value, cobb.after.value, cobb.change.value) == ("58.3°", "11.7°", "−23.3°")
    assert cobb.change.interval == "−25.5 to −21.1°"
    assert (rotation.change.value, rotation.change.note) == ("–", "no change was reported")


def test_a_single_stage_has_no_change() -> None:
    only = stage_spine(0)
    (cobb,) = headlines(only, only, "curve 1", ("cobb-fixed",))
    assert (cobb.before.value, cobb.after, cobb.change) == ("58.3°", None, None)


def test_every_pair_of_vertebrae_has_its_line() -> None:
    found = headlines(stage_spine(0), stage_spine(2), None, ("kyphosis", "lordosis"))
    assert [(line.name, line.before.value, line.change and line.change.value) for line in found] == [
        ("Kyphosis (T5–T12)", "–", "–"),
        ("Kyphosis (T7–T12)", "31.5°", "+1.2°"),
        ("Kyphosis (T10–L1)", "4.5°", "−0.8°"),
        ("Lordosis (L1–L5)", "–", "–"),
    ]
