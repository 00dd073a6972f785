import pytest

from contract.spine import StageSpine
from exports.entries import Entry, angle_interval, entries, normal_interval
from spinewatch.spine.configuration import Origin
from tests.contract.spine_results import measure, stage_spine


def found(spine: StageSpine) -> dict[tuple[str, str, str | None, str | None], Entry]:
    """Entries by subject, code, derivation and stage of comparison: the first of each."""
    by_key: dict[tuple[str, str, str | None, str | None], Entry] = {}
    for entry in entries(spine):
        by_key.setdefault((entry.subject, entry.code, entry.derivation, entry.since), entry)
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


def test_every_number_of_a_curve_has_its_open_ends() -> None:
    spine = stage_spine(1)
    assert {entry.open_ends for entry in entries(spine) if entry.kind == "curve"} == {("L1",)}
    assert {entry.open_ends for entry in entries(spine) if entry.kind != "curve"} == {()}


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
    assert given["T8", "position-y", None, None].status == "interpolated"
    unknown = [entry for key, entry in given.items() if key[0] == "T5"]
    assert [(entry.code, entry.value, entry.reason) for entry in unknown] == [
        ("pose", None, "it lies outside the marked vertebrae T7 to L1")
    ]


def test_the_origin_has_no_error_and_its_reason() -> None:
    entry = found(stage_spine(1))["L1", "position-x", None, None]
    assert (entry.value, entry.sd, entry.reason) == (0.0, 0.0, "its centroid is the origin by definition")
    assert found(stage_spine(1))["L1", "coronal-tilt", None, None].reason is None


def test_the_interval_of_an_angle_is_that_of_the_document_and_never_negative() -> None:
    spine = stage_spine(1)
    assert found(spine)["T9", "rotation-angle", "change", "PRE"].interval == (4.58, 8.55)
    assert spine.since_baseline is not None
    moved = spine.since_baseline.vertebrae[4].model_copy(
        update={"angle_deg": 0.5, "angle_interval_deg": None}
    )
    assert angle_interval(moved) == pytest.approx((0.0, 0.5 + 1.959964))
    assert angle_interval(moved.model_copy(update={"angle_deg": None})) is None


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


def test_every_pair_of_vertebrae_of_the_whole_spine_is_given() -> None:
    spine = stage_spine(2)
    listed = [entry for entry in entries(spine) if entry.code == "kyphosis"]
    assert [(entry.levels, entry.derivation, entry.since, entry.value) for entry in listed] == [
        (("T5", "T12"), None, None, None),
        (("T7", "T12"), None, None, 33.5),
        (("T10", "L1"), None, None, 6.5),
        (("T7", "T12"), "change", "PRE", 1.25),
        (("T10", "L1"), "change", "PRE", -0.75),
        (("T7", "T12"), "change", "INTER", 1.25),
        (("T10", "L1"), "change", "INTER", -0.75),
    ]
    everything = list(entries(spine))
    assert len({entry.identity for entry in everything}) == len(everything)


def test_every_pair_of_vertebrae_remains_to_the_target() -> None:
    pairs = [["T5", "T12"], ["T2", "T12"], ["T10", "L2"]]
    left = [measure("kyphosis", 1.0, curve=None, levels=pair) for pair in pairs]
    spine = stage_spine(0).model_copy(update={"target_measures": left})
    given = [entry for entry in entries(spine) if (entry.code, entry.derivation) == ("kyphosis", "remaining")]
    assert [list(entry.levels) for entry in given] == pairs


def test_shares_have_the_vertebrae_status_and_reason_of_their_quantity() -> None:
    given = found(stage_spine(1))
    cobb = given["curve 1", "cobb-fixed", "by-rotation", "PRE"]
    assert (cobb.levels, cobb.status, cobb.assumed, cobb.reason) == (("T7", "L1"), "measured", False, None)
    apex = given["curve 1", "apical-translation", "by-distraction", "PRE"]
    assert (apex.levels, apex.status, apex.reason) == (("T8",), "bracketed", "T8 has no marker")
    assert (apex.kind, apex.unit) == ("curve", "mm")


def test_shares_of_an_assumed_configuration_say_so_and_those_without_a_status_are_not_measured() -> None:
    spine = stage_spine(1)
    assert spine.since_baseline is not None
    cobb, _ = spine.since_baseline.attribution
    parts = [
        cobb.model_copy(update={"assumed": True}),
        cobb.model_copy(update={"subject": "x", "status": None}),
    ]
    change = spine.since_baseline.model_copy(update={"attribution": parts})
    given = found(spine.model_copy(update={"since_baseline": change}))
    assumed = given["curve 1", "cobb-fixed", "by-rotation", "PRE"]
    assert (assumed.status, assumed.assumed) == ("measured", True)
    assert given["x", "cobb-fixed", "by-rotation", "PRE"].status == "bracketed"


def test_measures_of_a_vertebra_without_a_marker_are_bracketed() -> None:
    spine = stage_spine(0)
    state = next(state for state in spine.vertebrae if state.vertebra == "T8")
    given = found(spine)
    lateral = given["T8", "lateral-displacement", None, None]
    assert (lateral.unit, lateral.status, lateral.reason) == (
        "mm",
        "bracketed",
        "T8 has no marker at this stage",
    )
    assert list(lateral.interval or ()) == state.lateral_displacement_interval_mm
    assert list(given["T8", "coronal-tilt", None, None].interval or ()) == state.coronal_tilt_interval_deg
    assert given["T9", "coronal-tilt", None, None].status == "measured"


def test_a_vertebra_of_an_earlier_version_is_as_its_pose() -> None:
    spine = stage_spine(0)
    lacking = {"coronal_tilt_interval_deg": None, "status": None, "bracketed_reason": None}
    states = [state.model_copy(update=lacking) for state in spine.vertebrae]
    tilt = found(spine.model_copy(update={"vertebrae": states}))["T8", "coronal-tilt", None, None]
    assert (tilt.status, tilt.interval) == ("interpolated", normal_interval(tilt.value, tilt.sd))
