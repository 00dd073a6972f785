"""Names of initial vertebrae that are a level off."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.levels import anatomical_sequence
from spinewatch.spine.configuration import InitialKind, InitialSpine
from spinewatch.spine.level_shift import LevelShiftParameters, level_shift_flags
from spinewatch.triads.pose import Pose

SEQUENCE = anatomical_sequence(())
LEVEL_MM = 25.0
HOLDER = np.array(LevelShiftParameters().holders.triad_offset_mm)


def place(number: float) -> Float:
    """Where a vertebra is: along a curve, cephalad +z."""
    return np.array([5 * np.sin(number / 4), 20 * np.sin(number / 5), -LEVEL_MM * number])


def spine(first: str, last: str, shift: int = 0, step: int = 1, turn: Float | None = None) -> InitialSpine:
    """The vertebrae from the first to the last, each named ``shift`` levels caudal of what it is."""
    numbers = range(SEQUENCE.index(first), SEQUENCE.index(last) + 1, step)
    R = np.eye(3) if turn is None else rotation_from_vector(turn)
    n = len(numbers)
    return InitialSpine(
        InitialKind.POSES,
        tuple(SEQUENCE[number + shift] for number in numbers),
        np.array([R @ place(number) for number in numbers]),
        np.stack([R] * n),
        np.tile(np.eye(6), (n, 1, 1)),
    )


def triads(*names: str, up_mm: float = 0.0, turn: Float | None = None) -> dict[str, Pose]:
    R = np.eye(3) if turn is None else rotation_from_vector(turn)
    return {
        name: Pose(R @ (place(SEQUENCE.index(name)) + HOLDER + np.array([0, 0, up_mm])), R, 0.1 * np.eye(6))
        for name in names
    }


def test_right_names_are_no_doubt() -> None:
    assert level_shift_flags(spine("T4", "L3"), triads("T5", "T8", "T11", "L2")) == ()


@pytest.mark.parametrize(("shift", "step"), [(-2, 1), (-1, 1), (1, 1), (2, 1), (-1, 2), (1, 2)])
def test_names_that_are_off_are_flagged_with_the_direction(shift: int, step: int) -> None:
    (flag,) = level_shift_flags(spine("T4", "L3", shift, step), triads("T7", "T11", "L1"))
    assert flag.code == "initial-levels-shifted"
    direction = "caudal" if shift > 0 else "cranial"
    assert f"those {abs(shift)} level{'s' * (abs(shift) > 1)} {direction} do" in flag.detail


@given(st.lists(st.floats(-3, 3), min_size=3, max_size=3))
def test_the_answer_does_not_depend_on_the_axes(turn: list[float]) -> None:
    wrong = spine("T4", "L3", 1, turn=np.array(turn)), triads("T5", "T8", "L1", turn=np.array(turn))
    assert [flag.code for flag in level_shift_flags(*wrong)] == ["initial-levels-shifted"]
    right = spine("T4", "L3", turn=np.array(turn)), triads("T5", "T8", "L1", turn=np.array(turn))
    assert level_shift_flags(*right) == ()


def test_wide_deviations_of_the_poses_decide_nothing() -> None:
    wrong = spine("T4", "L3", 1)
    common = np.zeros((len(wrong.levels), 6, 3))
    common[:, :3] = 30 * np.eye(3)
    vague = replace(wrong, errors=np.concatenate([wrong.errors, common], axis=2))
    assert level_shift_flags(vague, triads("T5", "T8", "L1")) == ()
    assert level_shift_flags(wrong, triads("T5", "T8", "L1"), placed_by_triads=True) == ()


def test_vague_poses_of_every_other_vertebra_are_no_doubt() -> None:
    right = spine("T1", "L4", step=2)
    n = len(right.levels)
    vague = replace(right, errors=50.0 * np.eye(6 * n).reshape(n, 6, 6 * n))  # of each vertebra its own
    assert level_shift_flags(vague, triads("T1", "T3", "T5", "T7", "T9", "T11", "L1", "L3")) == ()


def test_triads_far_from_every_vertebra_are_flagged() -> None:
    far = {
        name: replace(pose, position_mm=pose.position_mm + np.array([0, 50, 0]))
        for name, pose in triads("T5", "T8").items()
    }
    (flag,) = level_shift_flags(spine("T4", "L3"), far)
    assert flag.code == "initial-far-from-triads"
    assert "50 mm from where the initial configuration expects them" in flag.detail


def test_nothing_is_said_of_triads_beyond_the_configuration() -> None:
    assert level_shift_flags(spine("T4", "T9"), triads("L1")) == ()
