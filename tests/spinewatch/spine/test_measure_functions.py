from math import cos, degrees, radians, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spinewatch.arrays import Float
from spinewatch.spine.measure_functions import (
    FORMULAS,
    angle_3d,
    cobb_angle,
    coronal_balance,
    ferguson_angle,
    horizontal_difference,
    kyphosis,
    lateral_displacement,
    lordosis,
    plane_of_maximum_curvature,
    projected_axial_rotation,
    wrapped,
)

seeds = st.integers(0, 2**32 - 1)
MIRROR = np.diag([1.0, -1.0, 1.0])
LEVELS = {"ferguson": 3, "apical-rotation": 1, "apical-rotation-projected": 1, "apical-translation": 1}
UNCHANGED_BY_MIRROR = {"kyphosis", "lordosis", "angle-3d", "sagittal-tilt"}


def about_x(angle: float) -> Float:
    """Raises the left side."""
    s, c = sin(radians(angle)), cos(radians(angle))
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


def about_y(angle: float) -> Float:
    """Leans forwards."""
    s, c = sin(radians(angle)), cos(radians(angle))
    return np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])


def about_z(angle: float) -> Float:
    """Turns the anterior side to the left."""
    s, c = sin(radians(angle)), cos(radians(angle))
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


def of(definition: str, *rotations: Float) -> float:
    return float(FORMULAS[definition].function(np.zeros((len(rotations), 3)), np.array(rotations)))


@pytest.mark.parametrize(
    ("angle", "expected"), [(0, 0), (180, 180), (-180, 180), (181, -179), (-190, 170), (725, 5)]
)
def test_angles_wrap(angle: float, expected: float) -> None:
    assert wrapped(np.array([angle])) == pytest.approx([expected])


def test_coronal_tilt_is_positive_with_the_left_side_up() -> None:
    assert about_x(20.0)[:, 1] @ [0, 0, 1] > 0
    assert of("coronal-tilt", about_x(20.0)) == pytest.approx(20.0)
    assert of("coronal-tilt", about_y(20.0)) == pytest.approx(0.0)


def test_cobb_angle_of_a_curve_convex_to_the_right() -> None:
    # The upper end vertebra leans to the left and the lower one to the right: the bodies between lie to the right.
    upper, lower = about_x(-25.0), about_x(30.0)
    assert upper[1, 2] > 0
    assert lower[1, 2] < 0
    assert cobb_angle(upper, lower) == pytest.approx(55.0)
    assert of("cobb-fixed", lower, upper) == pytest.approx(-55.0)


def test_cobb_angle_sees_the_trace_in_the_coronal_plane() -> None:
    # z = (tan 40, -tan 30, 1) / norm: its coronal trace is 30 degrees whatever the sagittal tilt.
    z = np.array([np.tan(radians(40)), -np.tan(radians(30)), 1.0])
    z /= np.linalg.norm(z)
    y = np.cross(z, [1.0, 0, 0])
    y /= np.linalg.norm(y)
    R = np.stack([np.cross(y, z), y, z], axis=1)
    assert cobb_angle(np.eye(3), R) == pytest.approx(30.0)


def test_kyphosis_and_lordosis() -> None:
    assert of("sagittal-tilt", about_y(15.0)) == pytest.approx(15.0)
    assert kyphosis(about_y(25.0), about_y(-12.0)) == pytest.approx(37.0)
    assert lordosis(about_y(-20.0), about_y(30.0)) == pytest.approx(50.0)
    assert of("kyphosis", about_y(25.0), about_y(-12.0)) == pytest.approx(37.0)
    assert of("lordosis", about_y(-20.0), about_y(30.0)) == pytest.approx(50.0)


def test_axial_rotation_is_the_twist_about_the_vertebras_own_axis() -> None:
    assert of("axial-rotation", about_z(17.0)) == pytest.approx(17.0)
    assert of("apical-rotation", about_z(-17.0)) == pytest.approx(-17.0)
    # A swing about a horizontal axis has no twist, whatever its direction.
    swing = Rotation.from_rotvec(np.radians([30.0, 40.0, 0.0])).as_matrix()
    assert of("axial-rotation", swing) == pytest.approx(0.0, abs=1e-9)
    assert of("axial-rotation", swing @ about_z(12.0)) == pytest.approx(12.0)


def test_projected_axial_rotation() -> None:
    assert projected_axial_rotation(about_z(17.0)) == pytest.approx(17.0)
    # x = Rz(30) Ry(60) ex = Rz(30) (0.5, 0, ..): the projection is turned by 30 degrees.
    assert of("apical-rotation-projected", about_z(30.0) @ about_y(60.0)) == pytest.approx(30.0)
    # A lateral flexion after a twist of 45: x = Rx(60) (1, 1, 0)/sqrt 2, of which the top view shows (1, 0.5).
    assert of("apical-rotation-projected", about_x(60.0) @ about_z(45.0)) == pytest.approx(
        degrees(np.arctan(0.5))
    )


def test_the_plane_is_the_direction_of_the_horizontal_difference() -> None:
    d = horizontal_difference(about_y(30.0), about_y(-30.0))
    assert d == pytest.approx([1.0, 0.0])
    assert of("plane-of-maximum-curvature", about_y(30.0), about_y(-30.0)) == pytest.approx(0.0)


def test_angle_3d() -> None:
    assert angle_3d(about_x(-25.0), about_x(30.0)) == pytest.approx(55.0)
    # Tilts of 30 degrees forwards and 30 to the right: cos = cos(30)^2 = 0.75.
    assert of("angle-3d", about_y(30.0), about_x(30.0)) == pytest.approx(degrees(np.arccos(0.75)))
    assert of("angle-3d", about_x(10.0), about_x(10.0) @ about_z(70.0)) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(
    ("upper", "lower", "azimuth"),
    [
        (about_y(20.0), about_y(-20.0), 0.0),
        (about_x(-20.0), about_x(20.0), 90.0),
        (about_x(20.0), about_x(-20.0), -90.0),
        (about_y(-20.0), about_y(20.0), 180.0),
        (about_z(35.0) @ about_y(20.0), about_z(35.0) @ about_y(-10.0), 35.0),
    ],
)
def test_plane_of_maximum_curvature(upper: Float, lower: Float, azimuth: float) -> None:
    assert wrapped(plane_of_maximum_curvature(upper, lower) - azimuth) == pytest.approx(0.0, abs=1e-9)
    assert wrapped(np.array(of("plane-of-maximum-curvature", upper, lower) - azimuth)) == pytest.approx(
        0.0, abs=1e-9
    )


def test_displacements_are_positive_to_the_right() -> None:
    assert lateral_displacement(np.array([5.0, -12.0, 90.0])) == 12.0
    assert lateral_displacement(np.array([5.0, -12.0, 90.0]), np.array([1.0, 3.0, 0.0])) == 15.0
    assert coronal_balance(np.array([3.0, -20.0, 400.0]), np.array([0.0, -5.0, 0.0])) == 15.0
    position = np.array([[5.0, -12.0, 90.0], [0.0, 3.0, 0.0]])
    assert FORMULAS["apical-translation"].function(position[:1], np.eye(3)[None]) == 12.0
    assert FORMULAS["lateral-displacement"].function(position[:1], np.eye(3)[None]) == 12.0
    assert FORMULAS["lateral-displacement"].function(position, np.tile(np.eye(3), (2, 1, 1))) == 15.0
    assert FORMULAS["coronal-balance"].function(position, np.tile(np.eye(3), (2, 1, 1))) == 15.0


def test_ferguson_angle() -> None:
    # Apex 30 mm to the right of both end vertebrae, 100 mm below the upper and 60 mm above the lower one.
    upper, apex, lower = np.array([[0.0, 0, 160], [8.0, -30, 60], [0.0, 0, 0]])
    expected = degrees(np.arctan(30 / 100)) + degrees(np.arctan(30 / 60))
    assert ferguson_angle(upper, apex, lower) == pytest.approx(expected)
    assert FORMULAS["ferguson"].function(
        np.array([upper, apex, lower]), np.tile(np.eye(3), (3, 1, 1))
    ) == pytest.approx(expected)


@settings(deadline=None, max_examples=30)
@given(seeds, st.sampled_from(sorted(FORMULAS)))
def test_a_mirror_flips_the_signs_that_it_must(seed: int, definition: str) -> None:
    rng = np.random.default_rng(seed)
    k = LEVELS.get(definition, 1 if definition.endswith(("tilt", "rotation", "displacement")) else 2)
    position = rng.uniform(-100, 100, (k, 3))
    rotation = Rotation.from_rotvec(rng.uniform(-0.5, 0.5, (k, 3))).as_matrix()
    function = FORMULAS[definition].function
    # The mirror image of a vertebra: its left side becomes its right one.
    mirrored = function(position @ MIRROR, MIRROR @ rotation @ MIRROR)
    sign = 1.0 if definition in UNCHANGED_BY_MIRROR else -1.0
    assert mirrored == pytest.approx(sign * function(position, rotation), abs=1e-9)


@settings(deadline=None, max_examples=20)
@given(seeds, st.sampled_from(sorted(FORMULAS)))
def test_leading_dimensions_are_a_batch_and_declared_inputs_are_the_only_ones(
    seed: int, definition: str
) -> None:
    rng = np.random.default_rng(seed)
    position = rng.uniform(-100, 100, (4, 5, 3, 3))
    rotation = Rotation.random(20 * 3, rng=rng).as_matrix().reshape(4, 5, 3, 3, 3)
    formula = FORMULAS[definition]
    values = formula.function(position, rotation)
    assert values.shape == (4, 5)
    assert values[2, 3] == pytest.approx(float(formula.function(position[2, 3], rotation[2, 3])))
    assert formula.positions != formula.rotations
    unused = np.full_like(rotation, np.nan) if formula.positions else np.full_like(position, np.nan)
    again = formula.function(position, unused) if formula.positions else formula.function(unused, rotation)
    assert np.array_equal(again, values)
