from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.spine.patient_axes import (
    PatientAxesContradictedError,
    PatientAxesError,
    PatientAxesParameters,
    axes_from_directions,
    axes_from_landmarks,
    require_axes_of_triads,
    require_chain_along,
)
from spinewatch.triads.pose import Pose
from tests.spinewatch.spine.simulated import turn


def test_prone_with_the_head_along_minus_x_by_hand() -> None:
    # Posterior is up, so anterior is -Z; left = cephalad x anterior = (-X) x (-Z) = -Y.
    axes = axes_from_directions(np.array([-3.0, 0, 0]), np.array([0, -0.2, 0]))
    assert np.allclose(axes, np.column_stack([[0, 0, -1], [0, -1, 0], [-1, 0, 0]]))


def test_cephalad_is_kept_and_left_made_perpendicular() -> None:
    cephalad, left = np.array([0.0, 0, 2]), np.array([0.3, 1.0, 0.5])
    axes = axes_from_directions(cephalad, left)
    assert np.allclose(axes[:, 2], [0, 0, 1])
    assert np.allclose(axes[:, 1], np.array([0.3, 1, 0]) / np.hypot(0.3, 1))


@settings(deadline=None)
@given(st.integers(0, 10**6))
def test_axes_are_a_rotation_and_turn_with_the_directions(seed: int) -> None:
    rng = np.random.default_rng(seed)
    Q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    Q *= np.linalg.det(Q)
    cephalad, left = np.array([0.0, 0, 1]), np.array([0.1, 1, rng.uniform(-1, 1)])
    axes = axes_from_directions(cephalad, left)
    assert np.allclose(axes.T @ axes, np.eye(3))
    assert np.linalg.det(axes) == pytest.approx(1)
    assert np.allclose(axes_from_directions(Q @ cephalad, Q @ left), Q @ axes)


def test_landmarks_by_hand() -> None:
    caudal, cephalad = np.array([100.0, 50, 0]), np.array([-300.0, 50, 0])
    axes = axes_from_landmarks(caudal, cephalad, np.array([-50.0, -30, 20]))
    assert np.allclose(axes[:, 2], [-1, 0, 0])
    assert np.allclose(axes[:, 1], np.array([0, -80, 20]) / np.hypot(80, 20))


@pytest.mark.parametrize("bad", [[0.0, 0, 0], [np.nan, 0, 1], [np.inf, 0, 0]])
@pytest.mark.parametrize("which", ["cephalad", "left"])
def test_a_direction_that_is_none_is_named(bad: list[float], which: str) -> None:
    directions = {"cephalad": np.array([0.0, 0, 1]), "left": np.array([0.0, 1, 0])} | {which: np.array(bad)}
    with pytest.raises(PatientAxesError, match=f"^{which} is not a direction"):
        axes_from_directions(directions["cephalad"], directions["left"])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_nearly_parallel_directions_are_refused(sign: float) -> None:
    def left(angle_deg: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        angle = np.radians(angle_deg)
        return sign * np.array([0.0, np.sin(angle), np.cos(angle)])

    cephalad = np.array([0.0, 0, 1])
    with pytest.raises(PatientAxesError, match="9\\.9 degrees from parallel"):
        axes_from_directions(cephalad, left(9.9))
    assert np.allclose(axes_from_directions(cephalad, left(10.1)), np.diag([sign, sign, 1]))
    with pytest.raises(PatientAxesError):
        axes_from_directions(cephalad, left(10.1), PatientAxesParameters(min_angle_deg=20))


def test_landmarks_that_coincide_or_lie_on_a_line_are_refused() -> None:
    low, high = np.array([0.0, 0, 0]), np.array([0.0, 0, 400])
    with pytest.raises(PatientAxesError, match="caudal and cephalad are 5\\.0 mm apart"):
        axes_from_landmarks(low, np.array([0.0, 0, 5]), np.array([0.0, 100, 0]))
    with pytest.raises(PatientAxesError, match="cephalad and left are 3\\.0 mm apart"):
        axes_from_landmarks(low, high, np.array([0.0, 3, 400]))
    with pytest.raises(PatientAxesError, match="on a line"):
        axes_from_landmarks(low, high, np.array([0.0, 10, 350]))
    with pytest.raises(PatientAxesError):
        axes_from_landmarks(low, np.array([np.nan, 0, 0]), high)


def triads_at(angle_deg: float, normal: Float) -> dict[str, Pose]:
    """Return triads of L1, T10 and T12 on a line that leans by an angle, in patient axes, with a common normal."""
    up = turn(0, angle_deg, 0)[:, 2]
    R = np.column_stack([np.cross([0, 1, 0], normal), [0, 1, 0], normal])
    return {
        name: Pose(height * up, R, np.zeros((6, 6)))
        for name, height in (("L1", 0.0), ("T10", 80), ("T12", 30))
    }


BACK = np.array([-1.0, 0, 0])


@pytest.mark.parametrize("angle", [-50.0, 0.0, 50.0])
def test_triads_that_run_along_cephalad_are_accepted(angle: float) -> None:
    require_axes_of_triads(np.eye(3), triads_at(angle, BACK))


@pytest.mark.parametrize("angle", [-60.0, 60.0, 90.0, 180.0])
def test_triads_that_run_another_way_are_refused(angle: float) -> None:
    with pytest.raises(
        PatientAxesContradictedError, match=f"from L1 up to T10 they run {abs(angle):.0f} degrees from it"
    ):
        require_axes_of_triads(np.eye(3), triads_at(angle, BACK))


def test_axes_and_triads_that_turn_together_are_judged_alike() -> None:
    Q = turn(40, 100, -70)
    there = {
        name: Pose(Q @ pose.position_mm, Q @ pose.rotation, pose.covariance)
        for name, pose in triads_at(20, BACK).items()
    }
    require_axes_of_triads(Q, there)
    with pytest.raises(PatientAxesContradictedError, match="cephalad"):
        require_axes_of_triads(np.eye(3), there)


@pytest.mark.parametrize("names", [("L1", "T10", "T12"), ("L1",)])
def test_left_and_right_exchanged_are_refused(names: tuple[str, ...]) -> None:
    triads = {name: pose for name, pose in triads_at(10, BACK).items() if name in names}
    with pytest.raises(PatientAxesContradictedError, match="left and right may be exchanged"):
        require_axes_of_triads(np.diag([-1.0, -1.0, 1.0]), triads)


def test_triads_that_face_sidewards_are_accepted() -> None:
    triads = {
        name: Pose(pose.position_mm, turn(90, 0, 0), pose.covariance)
        for name, pose in triads_at(10, BACK).items()
    }
    require_axes_of_triads(np.eye(3), triads)


def test_one_triad_or_none_shows_no_direction_of_the_spine() -> None:
    require_axes_of_triads(np.eye(3), {})
    require_chain_along(("L1",), np.zeros((1, 3)), "the triads")


def test_limits_are_used() -> None:
    for limits in (
        PatientAxesParameters(max_chain_angle_deg=15, chain_tolerance_mm=0),
        PatientAxesParameters(max_chain_angle_deg=0),
    ):
        with pytest.raises(PatientAxesContradictedError):
            require_axes_of_triads(np.eye(3), triads_at(20, BACK), parameters=limits)
    require_axes_of_triads(
        np.diag([-1.0, -1.0, 1.0]),
        triads_at(0, BACK),
        parameters=PatientAxesParameters(min_front_angle_deg=0),
    )


def test_a_line_between_neighbours_may_lean_more() -> None:
    chain = np.array([[22.0, 0, 12], [0, 0, 0]])
    require_chain_along(("L4", "L5"), chain, "the triads")
    for position in (3 * chain, chain * [1, 1, -1]):
        with pytest.raises(PatientAxesContradictedError):
            require_chain_along(("L4", "L5"), position, "the triads")


def test_extra_levels_have_their_place() -> None:
    position = np.array([[0.0, 0, 30], [0, 0, 0]])
    require_chain_along(("T13", "L1"), position, "the triads", ["T13"])
    with pytest.raises(PatientAxesContradictedError, match="from L1 up to T13"):
        require_chain_along(("T13", "L1"), -position, "the triads", ["T13"])
