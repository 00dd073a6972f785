from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.spine.patient_axes import (
    PatientAxesError,
    PatientAxesParameters,
    axes_from_directions,
    axes_from_landmarks,
)


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
