"""The documents of a spine hold what the library gives; what is not determined is null."""

from __future__ import annotations

import json

import numpy as np
import pytest

from contract.spine import (
    ORIGIN_REASON,
    Attribution,
    Curve,
    MeasureValue,
    RemainingCorrection,
    Share,
    SpineChange,
    StageSpine,
    VertebraChange,
    VertebraState,
    spine_frame,
)
from contract.stage_reference import StageReference
from spinewatch.spine import results
from spinewatch.spine.comparison import compare_stages
from spinewatch.spine.configuration import InitialKind, Origin
from spinewatch.spine.definitions import DEFINITIONS
from spinewatch.spine.results import MeasureStatus
from spinewatch.spine.stage_spine import spine_at_stage
from spinewatch.spine.target import RemainingMotion
from spinewatch.spine.vertebra_measures import vertebra_measures
from tests.contract.spine_results import stage_spine
from tests.spinewatch.spine.simulated import LEVELS, surgery

NAN = float("nan")
CASE = surgery(21, marked=("T8", "T10", "L1"), noise=0.4, initial_sd=1.0)
PRE, POST = (spine_at_stage(CASE.setup, CASE.stages, name) for name in ("PRE", "POST"))
SINCE = StageReference(name="PRE", take=1, calibration_id="c")


def value(number: float = 12.0, **changes: object) -> results.MeasureValue:
    fields: dict[str, object] = {
        "definition": "apical-translation", "curve": "curve 1", "levels": ("T9",), "value": number, "sd": 1.0,
        "lower": number - 2, "upper": number + 2, "status": MeasureStatus.MEASURED, "assumed": False, "reason": None,
    }  # fmt: skip
    return results.MeasureValue(**{**fields, **changes})  # type: ignore[arg-type]


def test_a_document_passes_through_json_to_the_last_bit() -> None:
    made = stage_spine(2)
    assert StageSpine.model_validate_json(made.model_dump_json()) == made


def test_vertebrae_have_the_poses_of_the_configuration_and_their_own_tilts() -> None:
    states = VertebraState.of(POST, vertebra_measures(POST))
    covariances = POST.covariances()
    assert [state.vertebra for state in states] == list(LEVELS)
    for i, state in enumerate(states):
        assert (state.origin, state.marked, state.reason) == (
            POST.origins[i], POST.marked[i], POST.reasons[i],
        )  # fmt: skip
        if state.origin is Origin.NOT_MEASURED:
            assert (state.position_mm, state.covariance, state.coronal_tilt_deg) == (None, None, None)
            assert state.reason
            continue
        np.testing.assert_array_equal(state.position_mm, POST.poses.position_mm[i])
        np.testing.assert_array_equal(state.rotation, POST.poses.rotation[i])
        np.testing.assert_array_equal(state.covariance, covariances[i])
        z = POST.poses.rotation[i][:, 2]
        assert state.coronal_tilt_deg == pytest.approx(np.degrees(np.arctan2(-z[1], z[2])))
        assert state.sagittal_tilt_deg == pytest.approx(np.degrees(np.arctan2(z[0], z[2])))
        assert state.axial_rotation_sd_deg is not None
        from_reference = POST.poses.position_mm[i] - POST.poses.position_mm[POST.index("L1")]
        if state.vertebra == "L1":
            assert state.lateral_displacement_mm is None
            assert "L1 is the reference vertebra" in (state.not_measured_reason or "")
            continue
        assert state.lateral_displacement_mm == pytest.approx(-from_reference[1])
        # the same distance has the same error, whether it is a position or a displacement
        assert state.position_sd_mm is not None
        assert state.position_sd_mm[1] == pytest.approx(state.lateral_displacement_sd_mm, abs=1e-9)
    assert {state.origin for state in states} == {Origin.MEASURED, Origin.INTERPOLATED, Origin.NOT_MEASURED}


def test_the_reference_is_the_origin_without_an_error_and_says_so() -> None:
    states = {state.vertebra: state for state in VertebraState.of(POST, vertebra_measures(POST))}
    reference = states.pop("L1")
    assert reference.position_mm == pytest.approx([0, 0, 0], abs=1e-9)
    assert reference.position_sd_mm == pytest.approx([0, 0, 0], abs=1e-9)
    assert reference.position_reason == ORIGIN_REASON
    assert {state.position_reason for state in states.values()} == {None}


def test_vertebrae_have_the_intervals_of_the_library_and_say_where_they_are_bracketed() -> None:
    measures = {(m.levels[0], m.definition): m for m in vertebra_measures(POST)}
    for state in VertebraState.of(POST, measures.values()):
        if state.vertebra == "L1":  # the reference vertebra, whose displacement is zero by definition
            assert state.status is MeasureStatus.MEASURED
            continue
        lateral = measures[state.vertebra, "lateral-displacement"]
        assert state.status is lateral.status
        if state.status is MeasureStatus.NOT_MEASURED:
            assert (state.lateral_displacement_interval_mm, state.bracketed_reason) == (None, None)
            continue
        assert state.lateral_displacement_interval_mm == [lateral.lower, lateral.upper]
        assert state.bracketed_reason == lateral.reason
        assert (state.status is MeasureStatus.BRACKETED) == (state.origin is Origin.INTERPOLATED)


def test_documents_of_earlier_versions_are_read_with_what_qualifies_their_attributions() -> None:
    document = stage_spine(1).model_dump(mode="json")
    for state in document["vertebrae"]:
        for name in [
            name for name in state if "_interval_" in name or name in ("status", "bracketed_reason")
        ]:
            del state[name]
    change = document["since_baseline"]
    part = change["attribution"][0]
    for name in ("levels", "status", "assumed"):
        del part[name]
    change["measures"][0] |= {"assumed": True, "status": "bracketed"}
    shares = {name: dict(part[name]) for name in ("total", "rotation", "distraction")}
    change["attribution"] = [
        part,
        {**part, "subject": "T8", "quantity": "lateral-displacement"},
        {**part, "subject": "T9", "quantity": "lateral-displacement"},
        {
            **part,
            **shares,
            "subject": "T5",
            "total": dict.fromkeys(shares["total"]),
            "reason": "it is hidden",
        },
        {**part, "subject": "curve 7"},
    ]
    read = StageSpine.model_validate_json(json.dumps(document))
    assert read.vertebrae[4].coronal_tilt_interval_deg is None
    assert read.since_baseline is not None
    assert [(a.levels, a.status, a.assumed) for a in read.since_baseline.attribution] == [
        (["T7", "L1"], MeasureStatus.BRACKETED, True),
        (["T8"], MeasureStatus.BRACKETED, True),
        (["T9"], MeasureStatus.MEASURED, True),
        (["T5"], MeasureStatus.NOT_MEASURED, True),
        ([], MeasureStatus.BRACKETED, True),
    ]


def test_a_measure_has_the_unit_of_its_definition() -> None:
    made = MeasureValue.of(value())
    assert made.unit == DEFINITIONS["apical-translation"].unit == "mm"
    assert (made.value, made.sd, made.interval, made.levels) == (12.0, 1.0, [10.0, 14.0], ["T9"])


def test_what_is_not_measured_is_null() -> None:
    missing = value(NAN, sd=NAN, lower=NAN, upper=NAN, status=MeasureStatus.NOT_MEASURED, reason="no triad")
    made = MeasureValue.of(missing)
    assert (made.value, made.sd, made.interval, made.reason) == (None, None, None, "no triad")
    share = Share.of(results.Share(NAN, NAN, NAN, NAN))
    assert (share.value, share.sd, share.interval) == (None, None, None)


def test_a_curve() -> None:
    made = Curve.model_validate(results.Curve("curve 1", "T5", "T8", "T12", "right", ("T5",)))
    assert made.model_dump() == {
        "name": "curve 1", "upper": "T5", "apex": "T8", "lower": "T12", "side": "right", "open_ends": ["T5"],
    }  # fmt: skip


def test_a_change_holds_what_the_library_gives() -> None:
    given = compare_stages(PRE, POST, PRE, CASE.setup.reference)
    made = SpineChange.of(given, SINCE)
    assert made.since == SINCE
    for change, library in zip(made.vertebrae, given.vertebrae, strict=True):
        document = json.loads(change.model_dump_json())
        for name in set(document) - {"vertebra", "origin", "reason", "rotation", "angle_interval_deg"}:
            want = np.asarray(getattr(library, name), dtype=float)
            got = np.array(document[name], dtype=float)
            np.testing.assert_array_equal(got, want, err_msg=name)
        assert (change.rotation is None) == np.isnan(library.rotation).any()
        ends = [library.angle_lower_deg, library.angle_upper_deg]
        assert change.angle_interval_deg == (None if np.isnan(ends).any() else ends)
    assert [m.value for m in made.measures] == [
        None if np.isnan(m.value) else m.value for m in given.measures
    ]
    assert [a.subject for a in made.attribution] == [a.subject for a in given.attribution]


def test_a_vertebra_without_motion_is_null_with_a_reason() -> None:
    given = compare_stages(PRE, POST, PRE, CASE.setup.reference).vertebrae
    missing = [VertebraChange.of(change) for change in given if np.isnan(change.angle_deg)]
    assert missing
    for change in missing:
        assert (change.rotation, change.angle_deg, change.distraction_sd_mm) == (None, None, None)
        assert change.translation_mm == [None, None, None]
        assert change.angle_interval_deg is None
        assert change.reason


def test_an_attribution_has_the_unit_of_its_quantity() -> None:
    part = results.Share(1.0, 0.5, 0.0, 2.0)
    qualified = (None, ("T5", "T12"), MeasureStatus.MEASURED, True)
    given = results.Attribution(
        "curve 1", "cobb-fixed", part, part, part, results.Share(-1.0, 0.2, -1.4, -0.6), *qualified
    )
    made = Attribution.of(given)
    assert made.unit == "deg"
    assert made.remainder_share == Share(value=-1.0, sd=0.2, interval=[-1.4, -0.6])
    assert (made.levels, made.status, made.assumed) == (["T5", "T12"], MeasureStatus.MEASURED, True)
    assert made.rotation == Share(value=1.0, sd=0.5, interval=[0.0, 2.0])


def test_what_remains() -> None:
    unknown = np.full(3, NAN)
    given = RemainingMotion("T9", np.array([1.0, 2.0, 3.0]), np.array([0.1, 0.2, 0.3]), unknown, unknown)
    made = RemainingCorrection.of(given)
    assert (made.coronal_deg, made.sagittal_deg, made.axial_deg) == (1.0, 2.0, 3.0)
    assert made.sd_deg == [0.1, 0.2, 0.3]
    assert made.translation_mm == made.translation_sd_mm == [None, None, None]


def test_the_frame_names_the_baseline_and_the_reference() -> None:
    assert spine_frame("PRE", "L1") == stage_spine(1).frame
    assert {kind.value for kind in InitialKind} == {"poses", "radiographs", "generic"}
