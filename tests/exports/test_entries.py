import pytest

from contract.spine import StageSpine
from exports.entries import Entry, entries, normal_interval
from spinewatch.spine.configuration import Origin
from tests.contract.spine_results import measure, stage_spine


def found(spine: StageSpine) -> dict[tuple[str, str, str | None, str | None], Entry]:
    listed = list(entries(spine))
    by_key = {(entry.subject, entry.code, entry.derivation, entry.since): entry for entry in listed}
    assert len(by_key) == len(listed)
    return by_key


def test_the_interval_of_a_normal_value_reaches_1_96_standard_deviations() -> None:
    assert normal_interval(10.0, 2.0) == pytest.approx((6.080072, 13.919928))
    assert normal_interval(None, 2.0) is None
    assert normal_interval(10.0, None) is None


def test_a_measure_keeps_value_interval_status_and_reason() -> None:
    spine = stage_spine(1)
    given = found(spine)
    cobb = given["curve 1", "cobb-fixed", None, None]
    assert (cobb.kind, cobb.levels, cobb.value, cobb.interval) == (
        "curve",
        ("T7", "L1"),
        spine.measures[0].value,
        tuple(spine.measures[0].interval or ()),
    )
    bracketed = given["curve 1", "cobb-reselected", None, None]
    assert (bracketed.status, bracketed.reason) == ("bracketed", "T12 has no marker")
    kyphosis = given["spine", "kyphosis", None, None]
    assert (kyphosis.value, kyphosis.sd, kyphosis.interval, kyphosis.status) == (
        None,
        None,
        None,
        "not_measured",
    )


def test_a_value_that_is_marked_not_measured_is_never_given_as_a_number() -> None:
    odd = measure("kyphosis", 0.0, curve=None, status=stage_spine().measures[4].status)
    spine = stage_spine(0).model_copy(update={"measures": [odd]})
    assert found(spine)["spine", "kyphosis", None, None].value is None


def test_a_vertebra_gives_its_state_and_one_without_a_pose_its_reason_once() -> None:
    spine = stage_spine(0)
    given = found(spine)
    state = next(state for state in spine.vertebrae if state.vertebra == "T9")
    assert state.position_mm is not None
    assert [given["T9", f"position-{axis}", None, None].value for axis in "xyz"] == state.position_mm
    assert given["T9", "position-x", None, None].unit == "mm"
    assert given["T9", "coronal-tilt", None, None].value == state.coronal_tilt_deg
    assert given["T9", "coronal-tilt", None, None].unit == "deg"
    assert given["T8", "axial-rotation", None, None].status == "interpolated"
    unknown = [entry for key, entry in given.items() if key[0] == "T5"]
    assert [(entry.code, entry.value, entry.reason) for entry in unknown] == [
        ("pose", None, "it lies outside the marked vertebrae T7 to L1")
    ]


def test_what_is_assumed_says_so() -> None:
    spine = stage_spine(0)
    states = [state.model_copy(update={"origin": Origin.ASSUMED}) for state in spine.vertebrae]
    given = found(spine.model_copy(update={"vertebrae": states}))
    entry = given["T9", "coronal-tilt", None, None]
    assert (entry.status, entry.assumed) == ("assumed", True)


def test_a_measure_of_a_vertebra_is_given_once() -> None:
    spine = stage_spine(0)
    tilt = measure("coronal-tilt", 12.5, curve=None, levels=["T9"])
    given = found(spine.model_copy(update={"measures": [tilt]}))
    assert given["T9", "coronal-tilt", None, None].value == 12.5


def test_changes_are_given_since_the_baseline_and_since_the_stage_before() -> None:
    first, last = found(stage_spine(1)), found(stage_spine(2))
    assert {key[3] for key in first} == {None, "PRE"}
    assert {key[3] for key in last} == {None, "PRE", "INTER"}
    change = last["curve 1", "cobb-fixed", "change", "PRE"]
    assert (change.value, change.kind) == (-23.3, "curve")
    moved = last["T9", "derotation", "change", "INTER"]
    assert (moved.value, moved.sd, moved.unit) == (2.5, 0.6, "deg")
    assert last["T9", "distraction", "change", "INTER"].unit == "mm"
    assert last["T5", "motion", "change", "PRE"].reason == "it was not measured"


def test_shares_and_what_remains_are_given() -> None:
    given = found(stage_spine(2))
    assert given["curve 1", "cobb-fixed", "by-rotation", "PRE"].value == -18.0
    assert given["curve 1", "cobb-fixed", "by-distraction", "PRE"].interval == pytest.approx((-7.06, -3.14))
    assert given["curve 1", "cobb-fixed", "remaining", None].value == -5.0
    assert given["T9", "axial-rotation", "remaining", None].value == -3.0
    assert ("T9", "translation-x", "remaining", None) not in given
