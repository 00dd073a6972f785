from __future__ import annotations

import numpy as np
import pytest

from spinewatch.arrays import Float
from spinewatch.levels import LevelError
from spinewatch.spine.configuration import InitialKind, InitialSpine
from spinewatch.spine.initial import (
    InitialAnglesError,
    InitialLevelsError,
    InitialParameters,
    InitialPlacementError,
    InitialPoseError,
    initial_from_poses,
)
from spinewatch.spine.patient_axes import PatientAxesContradictedError
from spinewatch.triads.pose import Pose
from tests.spinewatch.spine.simulated import AXES, poses_of, turn

LEVELS = ("T11", "T12", "L1")
POSITION = np.array([[0.0, 5, 60], [0, 0, 30], [0, 0, 0]])
ROTATION = np.stack([turn(10, 0, 0), turn(0, 5, 0), np.eye(3)])


def initial(
    levels: tuple[str, ...] = LEVELS,
    position: Float = POSITION,
    rotation: Float = ROTATION,
    frame: str = "object",
    triads: dict[str, Pose] | None = None,
    position_sd: Float | float = 1.0,
) -> InitialSpine:
    """Return the configuration of poses in patient axes, which are turned to the axes of the frame."""
    assert frame in {"object", "patient"}
    return initial_from_poses(
        levels,
        position @ AXES.T if frame == "object" else position,
        AXES @ rotation if frame == "object" else rotation,
        position_sd,
        2.0,
        frame="object" if frame == "object" else "patient",
        patient_axes=AXES,
        triads=triads or {},
    )


def triads_behind(shift: Float, names: tuple[str, ...] = LEVELS) -> dict[str, Pose]:
    """Return triads 45 mm behind each body of the poses in patient axes, shifted in object space."""
    behind = POSITION + ROTATION @ [-45.0, 0, 0]
    return {name: poses_of(shift + AXES @ behind[LEVELS.index(name)], np.eye(3)) for name in names}


def test_poses_in_object_space_are_kept_as_they_are() -> None:
    spine = initial()
    assert spine.kind is InitialKind.POSES
    assert spine.levels == LEVELS
    assert np.array_equal(spine.position_mm, POSITION @ AXES.T)
    assert np.allclose(spine.rotation, AXES @ ROTATION, atol=1e-12)


def test_errors_are_independent_with_the_deviations_given() -> None:
    errors = initial(position_sd=np.array([1.0, 2.0, 3.0])).errors
    joint = errors.reshape(18, -1) @ errors.reshape(18, -1).T
    assert np.allclose(joint, np.diag([1, 1, 1, 4, 4, 4, 4, 4, 4, 4, 4, 4, 9, 9, 9, 4, 4, 4]))


def test_which_poses_turn_with_the_axes_follows_the_order_of_the_levels() -> None:
    assert initial().by_axes is None
    given = initial_from_poses(
        LEVELS[::-1],
        (POSITION @ AXES.T)[::-1],
        (AXES @ ROTATION)[::-1],
        1.0,
        2.0,
        frame="object",
        patient_axes=AXES,
        triads={},
        turned_with_axes=[True, False, False],
    )
    assert given.by_axes is not None
    assert given.levels[2] == "L1"
    assert not given.by_axes[:2].any()
    assert np.array_equal(given.by_axes[2], np.concatenate([np.zeros((3, 3)), AXES]))


def test_the_order_of_the_levels_changes_nothing() -> None:
    sd = np.array([1.0, 2.0, 3.0])
    down, up = (
        initial(position_sd=sd),
        initial(LEVELS[::-1], POSITION[::-1], ROTATION[::-1], position_sd=sd[::-1]),
    )
    assert up.levels == down.levels
    assert np.array_equal(up.position_mm, down.position_mm)
    assert np.array_equal(up.rotation, down.rotation)
    first, second = (s.errors @ np.swapaxes(s.errors, -1, -2) for s in (up, down))
    assert np.allclose(first, second)


def test_names_in_any_spelling() -> None:
    assert initial(("t11", "T12", " l01")).levels == LEVELS


@pytest.mark.parametrize("marked", [("T12",), LEVELS])
def test_poses_in_patient_axes_are_placed_by_the_triads(marked: tuple[str, ...]) -> None:
    shift = np.array([100.0, -50, 900])
    spine = initial(frame="patient", triads=triads_behind(shift, marked))
    assert np.allclose(spine.position_mm, shift + POSITION @ AXES.T)
    assert np.allclose(spine.rotation, AXES @ ROTATION)
    # The triads' offsets, 8 mm each, move the whole spine.
    covariance = spine.errors.reshape(18, -1) @ spine.errors.reshape(18, -1).T
    assert covariance[0, 0] == pytest.approx(1 + 64 / len(marked))
    assert covariance[0, 6] == pytest.approx(64 / len(marked))
    assert covariance[0, 1] == pytest.approx(0)
    assert covariance[3, 9] == 0


def test_any_origin_of_patient_axes_gives_the_same() -> None:
    triads = triads_behind(np.array([10.0, 20, 900]))
    here, there = (
        initial(position=POSITION + shift, frame="patient", triads=triads) for shift in (0.0, 500.0)
    )
    assert np.allclose(here.position_mm, there.position_mm)


def test_poses_that_the_triads_do_not_place_are_refused() -> None:
    with pytest.raises(
        InitialPlacementError, match="no vertebra of the initial configuration carries a triad"
    ):
        initial(frame="patient")
    triads = triads_behind(np.zeros(3))
    triads["T11"] = poses_of(triads["T11"].position_mm + np.array([0.0, 0, 150]), np.eye(3))
    with pytest.raises(InitialPlacementError, match="triad T11 is 100 mm from"):
        initial(frame="patient", triads=triads)


def test_poses_in_object_space_that_the_triads_contradict_are_refused() -> None:
    assert initial(triads=triads_behind(np.array([0.0, 60, 0]))).levels == LEVELS
    with pytest.raises(InitialPlacementError, match=r"triads are 120 mm from where .* or give frame patient"):
        initial(triads=triads_behind(np.array([0.0, 120, 0])))
    triads = triads_behind(np.zeros(3))
    triads["T11"] = poses_of(triads["T11"].position_mm + np.array([0.0, 0, 150]), np.eye(3))
    with pytest.raises(InitialPlacementError, match="triad T11 is 100 mm from"):
        initial(triads=triads)


def test_poses_of_patient_axes_are_refused_as_those_of_object_space() -> None:
    with pytest.raises((InitialAnglesError, PatientAxesContradictedError)):
        initial_from_poses(
            LEVELS,
            POSITION,
            ROTATION,
            1.0,
            2.0,
            frame="object",
            patient_axes=AXES,
            triads=triads_behind(np.zeros(3)),
        )


@pytest.mark.parametrize("frame", ["object", "patient"])
@pytest.mark.parametrize(
    ("turns", "words"),
    [
        ([turn(0, 0, 180)] * 3, "T11 is turned about the spine by 1[78]\\d degrees"),
        ([turn(95, 0, 0)] * 3, "is tilted by 105 degrees"),
        ([turn(0, -95, 0)] * 3, "is tilted by 9[0-9] degrees"),
        ([turn(50, 0, 0), turn(-50, 0, 0), turn(50, 0, 0)], "and T12 are turned by 1[01]\\d degrees against"),
        ([turn(0, 0, 60), turn(0, 0, 0), turn(0, 0, -60)], "T11 and T12 are turned by 6\\d degrees against"),
    ],
    ids=["about the spine", "coronal", "sagittal", "alternating", "axial"],
)
def test_vertebrae_that_are_turned_like_no_spine_are_refused(
    frame: str, turns: list[Float], words: str
) -> None:
    with pytest.raises(InitialAnglesError, match=words):
        initial(rotation=np.stack(turns) @ ROTATION, frame=frame, triads=triads_behind(np.zeros(3)))


def test_severe_deformities_are_accepted() -> None:
    initial(rotation=np.stack([turn(60, 0, 30), turn(30, 0, 50), turn(0, 0, 70)]))
    # Over a level without a pose, twice the rotation is possible.
    initial(("T11", "L1"), POSITION[::2], np.stack([turn(0, 60, 0), turn(0, -25, 0)]))


@pytest.mark.parametrize("frame", ["object", "patient"])
def test_vertebrae_that_do_not_run_along_the_axis_are_refused(frame: str) -> None:
    for position in (POSITION * [1, 1, -1], POSITION[:, [2, 1, 0]]):
        with pytest.raises(
            PatientAxesContradictedError, match="cephalad contradicts the initial configuration"
        ):
            initial(position=position, frame=frame, triads=triads_behind(np.zeros(3), ("T12",)))


def test_levels_must_be_known_unique_and_in_order() -> None:
    for levels, words in (
        (("T11", "T11", "L1"), "T11 is named twice"),
        (("T11", "L1", "T12"), "not in the order of the spine"),
        (("T11", "T12", "Q7"), "Q7 is not a vertebra"),
    ):
        with pytest.raises(LevelError, match=words):
            initial(levels)


def test_missing_levels_are_refused() -> None:
    with pytest.raises(InitialLevelsError, match="at least two"):
        initial(("T11",), POSITION[:1], ROTATION[:1])
    triad = {"T12": poses_of(np.zeros(3), np.eye(3)), "S1": poses_of(np.zeros(3), np.eye(3))}
    with pytest.raises(InitialLevelsError, match="vertebra T12 carries a triad and has no initial pose"):
        initial(("T11", "L1"), POSITION[::2], ROTATION[::2], triads=triad)
    assert initial(triads={"S1": triad["S1"]}).levels == LEVELS


@pytest.mark.parametrize(
    ("axes", "words"),
    [
        (np.diag([1.0, 1, -1]), "axes of T12 are left-handed"),
        (np.diag([1.0, 1.02, 1]), r"axes of T12 are not perpendicular unit vectors \(off by 0.0404\)"),
        (np.array([[1.0, 0.05, 0], [0, 1, 0], [0, 0, 1]]), "axes of T12 are not perpendicular"),
        (np.full((3, 3), np.nan), "pose of T12 is not finite"),
    ],
    ids=["reflected", "scaled", "sheared", "not finite"],
)
def test_axes_that_are_no_rotation_are_refused(axes: Float, words: str) -> None:
    rotation = ROTATION.copy()
    rotation[1] = axes
    with pytest.raises(InitialPoseError, match=words):
        initial(rotation=rotation)


def test_axes_of_three_decimals_are_accepted() -> None:
    R = initial(rotation=ROTATION.round(3)).rotation
    assert np.allclose(R, AXES @ ROTATION, atol=1e-3)
    assert np.allclose(np.swapaxes(R, -1, -2) @ R, np.eye(3), atol=1e-12)


def test_positions_must_be_finite_and_apart() -> None:
    for row, words in (
        ([0.0, np.inf, 0], "pose of T12 is not finite"),
        ([0.0, 1e300, 0], "position of T12 is beyond 10 m"),
        ([0.0, 0, 3], "T12 and L1 are 3.0 mm apart"),
    ):
        position = POSITION.copy()
        position[1] = row
        with pytest.raises(InitialPoseError, match=words):
            initial(position=position, frame="patient")


def test_the_least_distance_grows_with_the_levels_between() -> None:
    centimetres = np.array([[0.0, 0, 5.4], [0, 0, 0]])
    with pytest.raises(
        InitialPoseError, match=r"T11 and L1 are 5\.4 mm apart, less than 10 mm; give .* in mm"
    ):
        initial(("T11", "L1"), centimetres, ROTATION[::2], "patient")
    assert initial(("T11", "L1"), 2 * centimetres, ROTATION[::2]).levels == ("T11", "L1")


def test_deviations_must_not_be_negative() -> None:
    with pytest.raises(InitialPoseError, match="T11 is not finite, or a deviation is negative"):
        initial(position_sd=-1.0)


def test_numbers_of_poses_must_agree() -> None:
    with pytest.raises(InitialPoseError, match="3 vertebrae need 3 positions"):
        initial(position=POSITION[:2])


def test_parameters_are_used() -> None:
    spine = initial_from_poses(
        LEVELS,
        POSITION,
        ROTATION,
        0.0,
        0.0,
        frame="patient",
        patient_axes=AXES,
        triads={"L1": poses_of(np.zeros(3), np.eye(3))},
        parameters=InitialParameters(triad_offset_mm=(-30.0, 0.0, 10.0), triad_offset_sd_mm=3.0),
    )
    assert np.allclose(spine.position_mm[2], AXES @ [30, 0, -10])
    assert np.allclose(np.diag(spine.errors[2] @ spine.errors[2].T), [9, 9, 9, 0, 0, 0])
