from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.spine.orientation import (
    axis_from_tilts,
    rotation_from_tilts,
    tilt_gradients,
    tilts_of,
    twist_gradient,
    twist_of,
)

tilt = st.floats(-80, 80)


def about(axis: int, angle_deg: float) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    return rotation_from_vector(np.radians(angle_deg) * np.eye(3)[axis])


@pytest.mark.parametrize(
    ("axis", "number"),
    [(0, 0), (1, 1), (2, 2)],
    ids=["left side up", "leans forwards", "anterior to the left"],
)
def test_signs_by_hand(axis: int, number: int) -> None:
    # +x takes left (y) to up (z); +y takes up (z) to anterior (x); +z takes anterior (x) to left (y).
    expected = np.zeros(3)
    expected[number] = 12.0
    assert np.allclose(tilts_of(about(axis, 12.0)), expected)


def test_tilts_are_those_of_the_end_plate_traces() -> None:
    # z along (tan 20, -tan 30, 1): traces of 30 degrees in the frontal plane and 20 in the sagittal one.
    R = rotation_from_tilts(30.0, 20.0, 0.0)
    z = R[:, 2]
    assert z[1] / z[2] == pytest.approx(-np.tan(np.radians(30)))
    assert z[0] / z[2] == pytest.approx(np.tan(np.radians(20)))


def test_the_axis_of_tilts_is_a_unit_vector_with_the_slopes_of_the_end_plate() -> None:
    coronal, sagittal = np.radians([[0.0, 30.0, -40.0], [25.0, -20.0, 0.0]])
    x, y, z = axis_from_tilts(coronal, sagittal).T
    assert np.allclose(x * x + y * y + z * z, 1)
    assert np.allclose(np.arctan2(-y, z), coronal)
    assert np.allclose(np.arctan2(x, z), sagittal)


@settings(deadline=None)
@given(tilt, tilt, st.floats(-175, 175))
def test_tilts_and_rotations_are_inverse(coronal: float, sagittal: float, axial: float) -> None:
    R = rotation_from_tilts(coronal, sagittal, axial)
    assert np.allclose(R.T @ R, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1)
    assert np.allclose(tilts_of(R), (coronal, sagittal, axial), atol=1e-7)


@settings(deadline=None)
@given(st.integers(0, 10**6))
def test_the_twist_is_that_of_the_quaternion(seed: int) -> None:
    rotation = Rotation.from_rotvec(np.random.default_rng(seed).uniform(-1.5, 1.5, 3))
    _, _, z, w = rotation.as_quat()
    assert float(twist_of(rotation.as_matrix())) == pytest.approx(np.degrees(2 * np.arctan2(z, w)), abs=1e-9)


def test_a_swing_has_no_twist() -> None:
    swing = rotation_from_vector(np.radians([25.0, -40.0, 0.0]))
    assert float(twist_of(swing)) == pytest.approx(0, abs=1e-9)
    assert float(twist_of(swing @ about(2, 15.0))) == pytest.approx(15)


@settings(deadline=None)
@given(tilt, tilt, st.floats(-150, 150))
def test_gradients_are_finite_differences(coronal: float, sagittal: float, axial: float) -> None:
    R = rotation_from_tilts(coronal, sagittal, axial)
    gradients = tilt_gradients(R)
    assert np.allclose(gradients[2], twist_gradient(R))
    for axis in range(3):
        ahead, back = (np.array(tilts_of(about(axis, step) @ R)) for step in (1e-4, -1e-4))
        assert np.allclose((ahead - back) / 2e-4, gradients[:, axis], rtol=1e-5, atol=1e-5)


def test_arrays_of_any_shape() -> None:
    angles = np.random.default_rng(4).uniform(-30, 30, (3, 2, 4))
    R = rotation_from_tilts(*angles)
    assert R.shape == (2, 4, 3, 3)
    assert np.allclose(tilts_of(R), angles)
    assert tilt_gradients(R).shape == (2, 4, 3, 3)
    assert np.allclose(R[1, 2], rotation_from_tilts(*angles[:, 1, 2]))
