from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.geometry.covariance import covariance_factor
from spinewatch.geometry.rotations import rotation_from_vector, vector_from_rotation
from spinewatch.simulation import scoliosis
from spinewatch.spine.axes_errors import axes_factor
from spinewatch.spine.bodies import AXES as BY_AXES
from spinewatch.spine.bodies import INITIAL
from spinewatch.spine.configuration import InitialKind, InitialSpine, Origin, SpineSetup
from spinewatch.spine.initial import initial_from_poses
from spinewatch.spine.interpolation_model import InterpolationParameters
from spinewatch.spine.motion import ReferenceMissingError
from spinewatch.spine.stage_spine import spine_at_stage
from tests.spinewatch.spine.simulated import AXES, LEVELS, Surgery, disturbed, moved, surgery, turn

seeds = st.integers(0, 10**6)
SOME = ("T9", "T11", "L1", "L3")


def given_only(initial: InitialSpine, names: tuple[str, ...]) -> InitialSpine:
    rows = [initial.levels.index(name) for name in names]
    return replace(
        initial,
        levels=names,
        position_mm=initial.position_mm[rows],
        rotation=initial.rotation[rows],
        errors=initial.errors[rows],
    )


def test_with_all_marked_it_is_the_truth() -> None:
    case = surgery(1)
    for stage, truth in case.truth.items():
        spine = spine_at_stage(case.setup, case.stages, stage)
        assert spine.levels == LEVELS
        assert set(spine.origins) == {Origin.MEASURED}
        assert spine.reasons == (None,) * 8
        assert spine.alternatives == ()
        assert np.allclose(spine.poses.position_mm, truth.position_mm, atol=1e-9)
        assert np.allclose(spine.poses.rotation, truth.rotation, atol=1e-12)


def test_origins_and_reasons() -> None:
    case = surgery(2, SOME)
    spine = spine_at_stage(case.setup, case.stages, "POST")
    M, I, N = Origin.MEASURED, Origin.INTERPOLATED, Origin.NOT_MEASURED  # noqa: E741
    assert spine.origins == (N, M, I, M, I, M, I, M)
    assert spine.marked == (False, True, False, True, False, True, False, True)
    assert spine.reasons[0] == "it carries no triad, and it is not between vertebrae that were measured"
    assert spine.reasons[1:] == (None,) * 7
    assert np.isnan(spine.poses.position_mm[0]).all()
    assert np.isnan(spine.poses.rotation[0]).all()
    assert np.isnan(spine.covariances()[0]).all()
    assert not any(factor[0].any() for factor in spine.errors.values())
    assert len(spine.alternatives) == 3


def test_at_the_baseline_the_initial_poses_hold_for_all() -> None:
    case = surgery(3, SOME, initial_sd=1.0)
    spine = spine_at_stage(case.setup, case.stages, "PRE")
    assert set(spine.origins) == {Origin.MEASURED}
    assert spine.marked == (False, True, False, True, False, True, False, True)
    assert np.allclose(spine.poses.position_mm, case.truth["PRE"].position_mm)
    assert set(spine.errors) == {INITIAL}
    to_patient = np.kron(np.eye(2), AXES.T)
    assert np.allclose(spine.errors[INITIAL], to_patient @ case.setup.initial.errors)


@settings(deadline=None, max_examples=15)
@given(seeds)
def test_no_motion_reproduces_the_initial_configuration(seed: int) -> None:
    rng = np.random.default_rng(seed)
    case = surgery(seed, SOME)
    R, t = turn(*rng.uniform(-10, 10, 3)), rng.uniform(-100, 100, 3)
    stages = {
        "PRE": case.stages["PRE"],
        "POST": {name: moved(pose, R, t) for name, pose in case.stages["PRE"].items()},
    }
    for names in (LEVELS, SOME):
        setup = replace(case.setup, initial=given_only(case.setup.initial, names))
        before, after = (spine_at_stage(setup, stages, stage) for stage in ("PRE", "POST"))
        known = np.isfinite(after.poses.position_mm[:, 0])
        assert known.sum() == 7
        assert np.allclose(after.poses.position_mm[known], before.poses.position_mm[known], atol=1e-9)
        assert np.allclose(after.poses.rotation[known], before.poses.rotation[known], atol=1e-12)


@settings(deadline=None, max_examples=15)
@given(seeds)
def test_turning_the_rig_changes_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    case = surgery(seed, SOME, noise=0.3, initial_sd=1.0)
    turned = {
        stage: poses
        if stage == "PRE"
        else {
            name: moved(pose, R, t)
            for R, t in [(turn(*rng.uniform(-5.7, 5.7, 3)), rng.uniform(-57, 57, 3))]
            for name, pose in poses.items()
        }
        for stage, poses in case.stages.items()
    }
    here, there = (spine_at_stage(case.setup, stages, "POST") for stages in (case.stages, turned))
    assert np.allclose(here.poses.position_mm, there.poses.position_mm, atol=1e-9, equal_nan=True)
    assert np.allclose(here.poses.rotation, there.poses.rotation, atol=1e-11, equal_nan=True)
    assert np.allclose(here.covariances(), there.covariances(), atol=1e-9, equal_nan=True)


def test_the_rig_at_the_baseline_may_be_anywhere_too() -> None:
    case = surgery(4, SOME, noise=0.3, initial_sd=1.0)
    R, t = turn(4, -7, 5), np.array([60.0, -50, 40])
    initial = case.setup.initial
    to_object = np.kron(np.eye(2), R)
    setup = replace(
        case.setup,
        patient_axes=R @ case.setup.patient_axes,
        initial=replace(
            initial,
            position_mm=initial.position_mm @ R.T + t,
            rotation=R @ initial.rotation,
            errors=to_object @ initial.errors,
        ),
    )
    stages = dict(case.stages, PRE={name: moved(pose, R, t) for name, pose in case.stages["PRE"].items()})
    here, there = spine_at_stage(case.setup, case.stages, "POST"), spine_at_stage(setup, stages, "POST")
    assert np.allclose(here.poses.position_mm, there.poses.position_mm, atol=1e-9, equal_nan=True)
    assert np.allclose(here.covariances(), there.covariances(), atol=1e-9, equal_nan=True)


def test_the_order_of_the_triads_changes_nothing() -> None:
    case = surgery(5, SOME, noise=0.3)
    back = {
        stage: {name: poses[name] for name in reversed(list(poses))} for stage, poses in case.stages.items()
    }
    here, there = (spine_at_stage(case.setup, stages, "POST") for stages in (case.stages, back))
    assert here.levels == there.levels
    assert np.array_equal(here.poses.position_mm, there.poses.position_mm, equal_nan=True)
    for source, factor in here.errors.items():
        assert np.array_equal(factor, there.errors[source])


@settings(deadline=None, max_examples=8)
@given(seeds)
def test_errors_are_finite_differences(seed: int) -> None:
    case = surgery(seed, SOME, noise=1.0, initial_sd=1.0, motion_deg=6.0)
    spine = spine_at_stage(case.setup, case.stages, "POST")
    known = np.isfinite(spine.poses.position_mm[:, 0])
    step = 1e-4
    for stage in ("PRE", "POST"):
        factor = spine.errors[f"triads {stage}"]
        for column in range(0, factor.shape[2], 4):
            poses = dict(case.stages[stage])
            who = sorted(poses)[column // 6]
            L = covariance_factor(poses[who].covariance)
            poses[who] = disturbed(poses[who], step * L[:, column % 6])
            other = spine_at_stage(case.setup, {**case.stages, stage: poses}, "POST")
            shift = (other.poses.position_mm - spine.poses.position_mm)[known] / step
            turned = other.poses.rotation[known] @ np.swapaxes(spine.poses.rotation[known], -1, -2)
            assert np.allclose(shift, factor[known, :3, column], atol=5e-3)
            assert np.allclose(
                np.degrees(vector_from_rotation(turned)) / step, factor[known, 3:, column], atol=0.03
            )


@settings(deadline=None, max_examples=8)
@given(seeds)
def test_errors_of_the_initial_configuration_are_finite_differences(seed: int) -> None:
    case = surgery(seed, SOME, initial_sd=2.0, motion_deg=25.0)
    # A shift of all bodies together leaves their places along the spine as they are.
    case.setup.initial.errors[:, :3] = case.setup.initial.errors[:1, :3]
    spine = spine_at_stage(case.setup, case.stages, "POST")
    known = np.isfinite(spine.poses.position_mm[:, 0])
    step, initial, r = 1e-4, case.setup.initial, LEVELS.index("L1")
    for column in range(0, 48, 7):
        error = step * initial.errors[:, :, column]
        wrong = replace(
            initial,
            position_mm=initial.position_mm + error[:, :3],
            rotation=rotation_from_vector(np.radians(error[:, 3:])) @ initial.rotation,
        )
        other = spine_at_stage(replace(case.setup, initial=wrong), case.stages, "POST")
        # The frame of the spine stays where it is.
        shift = (other.poses.position_mm - spine.poses.position_mm + error[r, :3] @ AXES)[known] / step
        turned = other.poses.rotation[known] @ np.swapaxes(spine.poses.rotation[known], -1, -2)
        assert np.allclose(shift, spine.errors[INITIAL][known, :3, column], atol=2e-3)
        assert np.allclose(
            np.degrees(vector_from_rotation(turned)) / step,
            spine.errors[INITIAL][known, 3:, column],
            atol=1e-3,
        )


def test_levels_without_an_initial_pose_are_interpolated_at_every_stage() -> None:
    case = surgery(6, SOME)
    setup = replace(case.setup, initial=given_only(case.setup.initial, SOME))
    before, after = (spine_at_stage(setup, case.stages, stage) for stage in ("PRE", "POST"))
    M, I = Origin.MEASURED, Origin.INTERPOLATED  # noqa: E741
    assert before.levels == LEVELS[1:]
    assert before.origins == after.origins == (M, I, M, I, M, I, M)
    assert "interpolation PRE" in before.errors
    assert {"interpolation PRE", "interpolation POST"} <= set(after.errors)
    # What interpolation did not know at the baseline is the same error later, turned by the motion.
    i = before.index("T10")
    first, second = (c.errors["interpolation PRE"][i] for c in (before, after))
    assert np.allclose(np.linalg.norm(first), np.linalg.norm(second))
    assert len(before.alternatives) == 3


def test_a_single_marked_level_interpolates_nothing() -> None:
    case = surgery(7, ("L1",))
    spine = spine_at_stage(case.setup, case.stages, "POST")
    assert spine.origins.count(Origin.NOT_MEASURED) == 7
    assert spine.origins[LEVELS.index("L1")] is Origin.MEASURED
    assert np.allclose(spine.poses.position_mm[LEVELS.index("L1")], 0)


def test_a_triad_that_is_not_measured_at_a_stage_is_interpolated() -> None:
    case = surgery(8, SOME)
    stages = {stage: dict(poses) for stage, poses in case.stages.items()}
    del stages["POST"]["T11"]
    spine = spine_at_stage(case.setup, stages, "POST")
    assert spine.origins[LEVELS.index("T11")] is Origin.INTERPOLATED
    assert not spine.marked[LEVELS.index("T11")]
    del stages["POST"]["L3"]
    spine = spine_at_stage(case.setup, stages, "POST")
    assert spine.reasons[-1] == (
        "its triad was not measured at stage POST, and it is not between vertebrae that were measured"
    )
    del stages["POST"]["L1"]
    with pytest.raises(ReferenceMissingError, match="L1 was not measured at stage POST"):
        spine_at_stage(case.setup, stages, "POST")


def test_everything_from_a_generic_spine_is_assumed() -> None:
    case = surgery(9, SOME)
    setup = replace(case.setup, initial=replace(case.setup.initial, kind=InitialKind.GENERIC))
    spine = spine_at_stage(setup, case.stages, "POST")
    assert spine.assumed
    assert set(spine.origins) == {Origin.ASSUMED, Origin.NOT_MEASURED}
    assert not spine_at_stage(case.setup, case.stages, "POST").assumed


def test_the_size_of_interpolations_error_is_a_parameter() -> None:
    case = surgery(10, SOME)
    sds = []
    for irregularity in (0.5, 5.0):
        parameters = InterpolationParameters(rotation_irregularity_deg=irregularity)
        factor = spine_at_stage(case.setup, case.stages, "POST", parameters).errors["interpolation POST"]
        sds.append(np.sqrt((factor[2, 3:] ** 2).sum(axis=1)))
        assert not factor[list(map(LEVELS.index, SOME))].any()
    assert (sds[1] > sds[0]).all()
    # A value between two others of the same irregularity: at least sqrt(1.5) times that.
    assert (sds[1] > 5 * np.sqrt(1.4)).all()


def test_intervals_of_interpolated_vertebrae_cover_simulated_corrections() -> None:
    rng = np.random.default_rng(20)
    marked = scoliosis.LEVELS[::2]
    error, sd = [], []
    for number in range(60):
        before = scoliosis.random_scoliosis(rng, list(scoliosis.CurveKind)[number % 3])
        done = scoliosis.Manoeuvre(rng.uniform(0.2, 0.7), rng.uniform(-15, 15), rng.uniform(0, 0.5), 10.0)
        after = scoliosis.corrected(before, done, rng)
        objects = [scoliosis.placed(s.poses, AXES, np.array([0.0, 0, 900])) for s in (before, after)]
        mounts = scoliosis.random_mounts(rng, marked)
        stages = dict(zip(("PRE", "POST"), (scoliosis.triads_on(o, mounts) for o in objects), strict=True))
        initial = InitialSpine(
            InitialKind.POSES,
            scoliosis.LEVELS,
            objects[0].position_mm,
            objects[0].rotation,
            np.zeros((17, 6, 1)),
        )
        spine = spine_at_stage(SpineSetup(AXES, "L1", "PRE", initial), stages, "POST")
        r = scoliosis.LEVELS.index("L1")
        back = before.rotation[r] @ after.rotation[r].T
        rows = [i for i, origin in enumerate(spine.origins) if origin is Origin.INTERPOLATED]
        assert len(rows) == 8
        turned = spine.poses.rotation[rows] @ np.swapaxes(back @ after.rotation[rows], -1, -2)
        place = (after.poses.position_mm - after.poses.position_mm[r]) @ back.T
        shift = spine.poses.position_mm[rows] - place[rows]
        error.append(np.concatenate([shift, np.degrees(vector_from_rotation(turned))], axis=1))
        sd.append(np.sqrt(np.einsum("nii->ni", spine.covariances()[rows])))
    z = np.concatenate(error) / np.concatenate(sd)
    assert ((np.abs(z) < 1.96).mean(axis=0) > 0.93).all()
    assert (np.sqrt((z**2).mean(axis=0)) > 0.05).all()
    # Every second vertebra is enough for a degree.
    assert (np.sqrt((np.concatenate(error)[:, 3:] ** 2).mean(axis=0)) < 1.0).all()


def typed(case: Surgery, axes: Float, frame: str) -> SpineSetup:
    """Return the setup of a surgery with its true initial poses in a frame, placed by the axes that are stated."""
    poses = case.truth["PRE"]
    position, rotation = poses.position_mm, poses.rotation
    if frame != "patient":
        position = case.setup.initial.position_mm
        rotation = axes @ rotation if frame == "angles" else case.setup.initial.rotation
    initial = initial_from_poses(
        LEVELS,
        position,
        rotation,
        1.0,
        1.0,
        frame="patient" if frame == "patient" else "object",
        patient_axes=axes,
        triads=case.stages["PRE"],
        turned_with_axes=[frame != "object"] * len(LEVELS),
    )
    covariance = np.array([[9.0, 1, 0], [1, 4, 0], [0, 0, 16]])
    return SpineSetup(axes, "L1", "PRE", initial, axes_covariance_deg2=covariance)


@pytest.mark.parametrize("frame", ["object", "patient", "angles"])
@pytest.mark.parametrize("stage", ["PRE", "POST"])
def test_errors_of_the_axes_are_finite_differences(frame: str, stage: str) -> None:
    case = surgery(6, SOME)
    setup, step = typed(case, AXES, frame), 1e-4
    spine, reference = spine_at_stage(setup, case.stages, stage), LEVELS.index("L1")
    at_baseline = spine_at_stage(setup, case.stages, "PRE").errors[BY_AXES]
    known = np.isfinite(spine.poses.position_mm[:, 0])
    assert (known & ~np.array(spine.marked)).any()
    F = axes_factor(setup.axes_covariance_deg2)
    for column in range(3):
        truth = spine_at_stage(
            typed(case, AXES @ turn(*(step * F[:, column])), frame), case.stages, stage
        ).poses
        # The origin is the centroid of the reference at the baseline in both.
        moved_mm = (truth.position_mm - spine.poses.position_mm)[known] / step
        origin = at_baseline[reference, :3, column]
        assert np.allclose(moved_mm, spine.errors[BY_AXES][known, :3, column] - origin, atol=5e-3)
        turns = truth.rotation[known] @ np.swapaxes(spine.poses.rotation[known], -1, -2)
        turned_deg = np.degrees(vector_from_rotation(turns)) / step
        assert np.allclose(turned_deg, spine.errors[BY_AXES][known, 3:, column], atol=5e-3)


def test_poses_in_patient_axes_are_right_at_the_baseline_whatever_the_axes() -> None:
    case = surgery(6, SOME)
    errors = spine_at_stage(typed(case, AXES, "patient"), case.stages, "PRE").errors[BY_AXES]
    assert np.allclose(errors[:, 3:], 0, atol=1e-12)
    assert np.allclose(errors[:, :3], errors[0, :3], atol=1e-9)
    later = spine_at_stage(typed(case, AXES, "patient"), case.stages, "POST").errors[BY_AXES]
    assert np.abs(later[:, 3:]).max() > 0.1


def test_exact_axes_have_no_source_of_errors() -> None:
    case = surgery(3, SOME, noise=0.3, initial_sd=1.0)
    assert BY_AXES not in spine_at_stage(case.setup, case.stages, "POST").errors


def test_a_generic_spine_says_nothing_beyond_the_markers() -> None:
    case = surgery(12, ("T9", "T11", "L1"))
    setup = replace(case.setup, initial=replace(case.setup.initial, kind=InitialKind.GENERIC))
    beyond = [
        level for level in LEVELS if not LEVELS.index("T9") <= LEVELS.index(level) <= LEVELS.index("L1")
    ]
    assert beyond
    for stage in ("PRE", "POST"):
        found = spine_at_stage(setup, case.stages, stage)
        missing = [
            level
            for level, origin in zip(found.levels, found.origins, strict=True)
            if origin is Origin.NOT_MEASURED
        ]
        assert missing == beyond
        reasons = {found.reasons[found.index(level)] for level in beyond}
        assert reasons == {"it carries no triad, and it is not between vertebrae that were measured"}
        assert np.isnan(found.poses.position_mm[found.index(beyond[0])]).all()
