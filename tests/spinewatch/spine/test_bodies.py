from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.geometry.covariance import covariance_factor
from spinewatch.geometry.rotations import vector_from_rotation
from spinewatch.spine.bodies import (
    INITIAL,
    RebaselineError,
    StageMissingError,
    measured_bodies,
    object_to_spine,
    triads_source,
)
from spinewatch.spine.configuration import InitialKind, InitialSpine, Rebaseline, SpineSetup
from spinewatch.spine.motion import ReferenceMissingError
from tests.spinewatch.spine.simulated import LEVELS, disturbed, poses_of, surgery, turn

seeds = st.integers(0, 10**6)


def two_vertebrae() -> SpineSetup:
    initial = InitialSpine(
        InitialKind.POSES,
        ("T12", "L1"),
        np.array([[0.0, 0, 30], [0, 0, 0]]),
        np.stack([np.eye(3)] * 2),
        np.zeros((2, 6, 1)),
    )
    return SpineSetup(np.eye(3), "L1", "PRE", initial)


def test_a_body_turns_about_its_triad_by_hand() -> None:
    # T12's triad is 40 mm behind the body and turns a quarter about z where it is: the body swings from 40 mm before
    # the triad (+x) to 40 mm beside it (+y).
    setup = two_vertebrae()
    reference = poses_of(np.array([-40.0, 0, 0]), np.eye(3))
    stages = {
        "PRE": {"T12": poses_of(np.array([-40.0, 0, 30]), np.eye(3)), "L1": reference},
        "POST": {"T12": poses_of(np.array([-40.0, 0, 35]), turn(0, 0, 90)), "L1": reference},
    }
    bodies = measured_bodies(setup, stages, "POST")
    assert bodies.levels == ("T12", "L1")
    assert np.allclose(bodies.poses.position_mm, [[-40, 40, 35], [0, 0, 0]])
    assert np.allclose(bodies.poses.rotation[0], turn(0, 0, 90))
    assert np.allclose(bodies.poses.rotation[1], np.eye(3))


@settings(deadline=None, max_examples=20)
@given(seeds)
def test_bodies_are_where_the_truth_has_them_wherever_the_cart_is(seed: int) -> None:
    case = surgery(seed)
    for stage in case.stages:
        bodies = measured_bodies(case.setup, case.stages, stage)
        assert bodies.marked.all()
        assert np.allclose(bodies.poses.position_mm, case.truth[stage].position_mm, atol=1e-9)
        assert np.allclose(bodies.poses.rotation, case.truth[stage].rotation, atol=1e-12)


@settings(deadline=None, max_examples=20)
@given(seeds)
def test_triads_keep_their_places_on_the_bodies_in_the_frame_of_the_spine(seed: int) -> None:
    case = surgery(seed)
    for name in case.stages["PRE"]:
        seen = []
        for stage, triads in case.stages.items():
            to_spine = object_to_spine(case.setup, case.stages, stage)
            i = LEVELS.index(name)
            centroid, R = case.truth[stage].position_mm[i], case.truth[stage].rotation[i]
            seen.append(R.T @ (to_spine(triads[name].position_mm[None])[0] - centroid))
        assert np.allclose(seen, seen[0], atol=1e-9)


def test_the_frame_of_the_spine_is_the_patients_at_the_baseline() -> None:
    setup = replace(two_vertebrae(), patient_axes=turn(0, 0, 90))
    reference = poses_of(np.array([-40.0, 0, 0]), np.eye(3))
    moved = poses_of(np.array([10.0, 5, 0]), turn(0, 0, 30))
    stages = {"PRE": {"L1": reference}, "POST": {"L1": moved}}
    assert np.allclose(object_to_spine(setup, stages, "PRE").rotation, turn(0, 0, -90))
    assert np.allclose(object_to_spine(setup, stages, "PRE").translation_mm, 0)
    after = object_to_spine(setup, stages, "POST")
    assert np.allclose(after(moved.position_mm[None]), [[0, 40, 0]])
    assert np.allclose(after.rotation, turn(0, 0, -120))


@settings(deadline=None, max_examples=10)
@given(seeds, st.booleans())
def test_errors_are_finite_differences(seed: int, clamped_again: bool) -> None:
    case = surgery(seed, ("T9", "T11", "L1"), ("PRE", "A", "B", "POST"), noise=1.0, initial_sd=1.0)
    rebaselines = (Rebaseline("T9", "A", "B"),) if clamped_again else ()
    case = replace(case, setup=replace(case.setup, rebaselines=rebaselines))
    bodies = measured_bodies(case.setup, case.stages, "POST")
    assert len(bodies.errors) == (5 if clamped_again else 3)
    step = 1e-4
    for source, factor in bodies.errors.items():
        for column in range(0, factor.shape[2], 5):
            setup, stages = case.setup, {name: dict(poses) for name, poses in case.stages.items()}
            if source == INITIAL:
                errors = step * setup.initial.errors[:, :, column]
                turned = np.array([turn(*e[3:]) for e in errors]) @ setup.initial.rotation
                # The frame of the spine stays where it is.
                moved = setup.initial.position_mm + errors[:, :3]
                shift = (errors[LEVELS.index("L1"), :3] @ setup.patient_axes)[None]
                setup = replace(setup, initial=replace(setup.initial, position_mm=moved, rotation=turned))
            else:
                stage, shift = source.removeprefix("triads "), np.zeros((1, 3))
                who = sorted(stages[stage])[column // 6]
                L = covariance_factor(stages[stage][who].covariance)
                stages[stage][who] = disturbed(stages[stage][who], step * L[:, column % 6])
            other = measured_bodies(setup, stages, "POST")
            rows = bodies.marked
            change = (other.poses.position_mm - bodies.poses.position_mm + shift)[rows] / step
            turns = other.poses.rotation[rows] @ np.swapaxes(bodies.poses.rotation[rows], -1, -2)
            assert np.allclose(change, factor[rows, :3, column], atol=2e-3)
            assert np.allclose(
                np.degrees(vector_from_rotation(turns)) / step, factor[rows, 3:, column], atol=2e-3
            )


def test_a_source_has_six_columns_for_each_triad_of_its_stage() -> None:
    case = surgery(1, ("T9", "T11", "L1"), noise=1.0)
    for stage in ("INTER", "POST"):
        errors = measured_bodies(case.setup, case.stages, stage).errors
        assert set(errors) == {INITIAL, triads_source("PRE"), triads_source(stage)}
        assert errors[triads_source("PRE")].shape == (8, 6, 18)
    # The reference follows itself.
    assert not errors[triads_source("PRE")][LEVELS.index("L1")].any()


def test_a_reclamped_marker_changes_nothing() -> None:
    plain = surgery(3, stages=("PRE", "A", "B", "POST"), noise=0.5)
    kept = {name: dict(poses) for name, poses in plain.stages.items()}
    # The spine is at B where it was at A, seen from the same place; T10's marker is clamped elsewhere from B on.
    kept["B"] = dict(kept["A"])
    new_place = (turn(20, -30, 70), np.array([3.0, -8, 5]))
    for name in ("B", "POST"):
        old = kept[name]["T10"]
        kept[name]["T10"] = poses_of(
            old.position_mm + old.rotation @ new_place[1], old.rotation @ new_place[0], old.covariance
        )
    wrong = measured_bodies(plain.setup, kept, "POST")
    setup = replace(plain.setup, rebaselines=(Rebaseline("T10", "A", "B"),))
    right = measured_bodies(setup, kept, "POST")
    expected = measured_bodies(plain.setup, plain.stages, "POST")
    assert not np.allclose(wrong.poses.position_mm, expected.poses.position_mm, atol=1)
    assert np.allclose(right.poses.position_mm, expected.poses.position_mm, atol=1e-9)
    assert np.allclose(right.poses.rotation, expected.poses.rotation, atol=1e-12)
    assert {triads_source("A"), triads_source("B")} <= set(right.errors)
    i = LEVELS.index("T10")
    assert np.trace(right.errors[triads_source("B")][i] @ right.errors[triads_source("B")][i].T) > 0
    assert not right.errors[triads_source("B")][LEVELS.index("T9")].any()
    # Before it was clamped again, the marker is in its former place; going back from a later baseline is the same path.
    at_a = measured_bodies(setup, kept, "A")
    assert triads_source("B") not in at_a.errors
    late = measured_bodies(replace(setup, baseline="POST"), kept, "PRE")
    late_plain = measured_bodies(replace(plain.setup, baseline="POST"), plain.stages, "PRE")
    assert np.allclose(late.poses.position_mm, late_plain.poses.position_mm, atol=1e-9)


def test_a_marker_may_be_clamped_again_twice() -> None:
    case = surgery(12, stages=("PRE", "A", "B", "C", "D", "POST"))
    stages = {name: dict(poses) for name, poses in case.stages.items()}
    # The spine moves from PRE to A, from B to C and from D to POST only.
    stages["B"], stages["D"] = dict(stages["A"]), dict(stages["C"])
    for number, changed in enumerate((("B", "C"), ("D", "POST"))):
        for name in changed:
            old = stages[name]["T10"]
            place = 10.0 * np.array([number + 1, -number, 1.0])
            stages[name]["T10"] = poses_of(
                old.position_mm + old.rotation @ place,
                old.rotation @ turn(20, 30 * number, -10),
                old.covariance,
            )
    setup = replace(case.setup, rebaselines=(Rebaseline("T10", "A", "B"), Rebaseline("T10", "C", "D")))
    for baseline, stage in (("PRE", "POST"), ("POST", "PRE"), ("PRE", "C"), ("B", "POST")):
        found, expected = (
            measured_bodies(replace(s, baseline=baseline), given, stage)
            for s, given in ((setup, stages), (case.setup, case.stages))
        )
        if baseline == "B":
            # There the spine is where it was at A.
            expected = measured_bodies(replace(case.setup, baseline="A"), case.stages, stage)
        assert np.allclose(found.poses.position_mm, expected.poses.position_mm, atol=1e-9)
        assert np.allclose(found.poses.rotation, expected.poses.rotation, atol=1e-12)


def test_a_marker_that_is_being_clamped_again_is_not_used() -> None:
    case = surgery(4, stages=("PRE", "A", "B", "POST"))
    setup = replace(case.setup, rebaselines=(Rebaseline("T10", "PRE", "B"),))
    bodies = measured_bodies(setup, case.stages, "A")
    i = LEVELS.index("T10")
    assert not bodies.marked[i]
    assert bodies.reasons[i] == "its marker was being clamped again"


def test_reasons_name_what_is_missing() -> None:
    case = surgery(5, ("T8", "T9", "T10", "T11", "L1"), stages=("PRE", "A", "B", "POST"))
    stages = {name: dict(poses) for name, poses in case.stages.items()}
    del stages["POST"]["T8"]
    del stages["PRE"]["T9"]
    del stages["A"]["T10"]
    del stages["B"]["L1"]
    setup = replace(case.setup, rebaselines=(Rebaseline("T10", "A", "B"), Rebaseline("T11", "A", "B")))
    reasons = dict(zip(LEVELS, measured_bodies(setup, stages, "POST").reasons, strict=True))
    assert reasons["T8"] == "its triad was not measured at stage POST"
    assert reasons["T9"] == "its triad was not measured at the baseline PRE"
    assert reasons["T10"] == "the triad of the reference L1 was not measured at stage B"
    assert reasons["T11"] == "the triad of the reference L1 was not measured at stage B"
    assert reasons["T12"] == "it carries no triad"
    assert reasons["L1"] is None


def test_a_marker_beyond_the_initial_configuration_has_no_body() -> None:
    case = surgery(6)
    few = replace(
        case.setup.initial,
        levels=LEVELS[2:],
        position_mm=case.setup.initial.position_mm[2:],
        rotation=case.setup.initial.rotation[2:],
        errors=case.setup.initial.errors[2:],
    )
    bodies = measured_bodies(replace(case.setup, initial=few), case.stages, "POST")
    assert bodies.levels == LEVELS
    assert bodies.reasons[0] == "the initial configuration has no pose of it"
    assert list(bodies.marked) == [False, False, True, True, True, True, True, True]


def test_a_triad_that_first_appears_after_the_baseline_is_a_vertebra_of_every_stage() -> None:
    case = surgery(6, stages=("PRE", "A", "B"))
    few = replace(
        case.setup.initial,
        levels=LEVELS[2:],
        position_mm=case.setup.initial.position_mm[2:],
        rotation=case.setup.initial.rotation[2:],
        errors=case.setup.initial.errors[2:],
    )
    stages = {
        name: {who: pose for who, pose in poses.items() if name == "A" or who not in LEVELS[:2]}
        for name, poses in case.stages.items()
    }
    for stage in stages:
        bodies = measured_bodies(replace(case.setup, initial=few), stages, stage)
        assert bodies.levels == LEVELS
        assert bodies.reasons[:2] == ("its triad was not measured at the baseline PRE",) * 2


@settings(deadline=None, max_examples=20)
@given(st.lists(st.sets(st.sampled_from(["T6", *LEVELS, "T13", "L4"])), min_size=2, max_size=4))
def test_no_triad_of_any_stage_is_dropped_without_a_reason(seen: list[set[str]]) -> None:
    pose = poses_of(np.zeros(3), np.eye(3))
    stages = {str(i): dict.fromkeys(sorted(names | {"L1"}), pose) for i, names in enumerate(seen)}
    setup = replace(two_vertebrae(), baseline="0")
    found = [measured_bodies(setup, stages, stage) for stage in stages]
    assert len({bodies.levels for bodies in found}) == 1
    for bodies in found:
        assert set.union(*map(set, stages.values())) <= set(bodies.levels)
        assert all(marked or reason for marked, reason in zip(bodies.marked, bodies.reasons, strict=True))


def test_a_declared_level_needs_no_triad() -> None:
    setup = replace(two_vertebrae(), extra_levels=("T13",))
    pose = poses_of(np.zeros(3), np.eye(3))
    bodies = measured_bodies(setup, {"PRE": {"L1": pose}}, "PRE")
    assert bodies.levels == ("T12", "T13", "L1")
    assert bodies.reasons[1] == "it carries no triad"


def test_extra_levels_have_their_place() -> None:
    case = surgery(6)
    names = (*LEVELS[:5], "T13", "L1", "L2")
    case_triads = {
        stage: dict(zip(names, poses.values(), strict=True)) for stage, poses in case.stages.items()
    }
    initial = replace(case.setup.initial, levels=names)
    assert measured_bodies(replace(case.setup, initial=initial), case_triads, "POST").levels == names


def test_a_reference_without_an_initial_pose_has_its_triad_as_origin() -> None:
    case = surgery(7)
    keep = [i for i, name in enumerate(LEVELS) if name != "L3"]
    few = replace(
        case.setup.initial,
        levels=LEVELS[:-1],
        position_mm=case.setup.initial.position_mm[keep],
        rotation=case.setup.initial.rotation[keep],
        errors=case.setup.initial.errors[keep],
    )
    bodies = measured_bodies(replace(case.setup, initial=few, reference="L3"), case.stages, "PRE")
    P = case.stages["PRE"]["L3"].position_mm
    expected = (few.position_mm[0] - P) @ case.setup.patient_axes
    assert np.allclose(bodies.poses.position_mm[0], expected)


def test_what_is_missing_is_named() -> None:
    case = surgery(8)
    with pytest.raises(StageMissingError, match="stage LATER is not among"):
        measured_bodies(case.setup, case.stages, "LATER")
    setup = replace(case.setup, rebaselines=(Rebaseline("T9", "PRE", "X"),))
    with pytest.raises(StageMissingError, match="stage X "):
        measured_bodies(setup, case.stages, "POST")
    for stage in ("PRE", "POST"):
        stages = {name: dict(poses) for name, poses in case.stages.items()}
        del stages[stage]["L1"]
        with pytest.raises(ReferenceMissingError, match=f"reference L1 was not measured at stage {stage}"):
            measured_bodies(case.setup, stages, "POST")


def test_rebaselines_that_cannot_be_are_refused() -> None:
    case = surgery(9)
    setup = replace(case.setup, rebaselines=(Rebaseline("L1", "PRE", "INTER"),))
    with pytest.raises(RebaselineError, match="the reference L1 was clamped again"):
        measured_bodies(setup, case.stages, "POST")
    setup = replace(case.setup, rebaselines=(Rebaseline("T9", "POST", "INTER"),))
    with pytest.raises(RebaselineError, match="stage POST is not before INTER"):
        measured_bodies(setup, case.stages, "POST")
