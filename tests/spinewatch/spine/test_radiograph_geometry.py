"""Poses from landmarks in two views: hand-computed cases, and projections by brute force."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.errors import ParameterError
from spinewatch.geometry.rotations import rotation_from_vector, vector_from_rotation
from spinewatch.simulation.radiographs import shown_vertebra
from spinewatch.spine.radiograph_geometry import (
    VertebraShapeParameters,
    projected_points,
    projected_poses,
    projected_variances,
    rotation_from_end_plates,
    shared_heights,
)
from spinewatch.spine.radiograph_landmarks import CommonPoint, LandmarkedVertebra, RadiographView
from tests.spinewatch.spine.radiograph_scenes import HEIGHT_OFFSET_MM, LATERAL, PA, scene, seen

FRONT, SIDE = RadiographView((1.0, 1.0), "right"), RadiographView((1.0, 1.0), "right")
UPRIGHT = np.array([[20.0, -10], [-20, -10], [20, 10], [-20, 10]])
"""Corners of an upright body at the pixel (0, 0), 40 mm wide and 20 mm high."""


def one(frontal: Float, sagittal: Float, pedicles: Float | None = None) -> tuple[Float, Float]:
    vertebra = LandmarkedVertebra("T9", frontal, sagittal, pedicles)
    poses = projected_poses(FRONT, SIDE, [vertebra], 0.0, 1.0)
    return poses.position_mm[0], poses.rotation[0]


def turned(points: Float, degrees: float) -> Float:
    """Return points turned clockwise in an image with v downwards: right side down."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.asarray(points @ np.array([[c, s], [-s, c]]))


def test_an_upright_body_has_the_axes_of_the_patient() -> None:
    position, rotation = one(UPRIGHT + np.array([5, -7]), UPRIGHT + np.array([3, -7]))
    np.testing.assert_allclose(position, [3, 5, 7], atol=1e-12)
    np.testing.assert_allclose(rotation, np.eye(3), atol=1e-12)


def test_the_coronal_tilt_is_positive_with_the_left_side_up() -> None:
    # The image's right is the patient's left. Turning anticlockwise by 30 degrees lifts it.
    _, rotation = one(turned(UPRIGHT, -30), UPRIGHT)
    z = rotation[:, 2]
    assert np.degrees(np.arctan2(-z[1], z[2])) == pytest.approx(30)
    assert np.degrees(np.arctan2(z[0], z[2])) == pytest.approx(0)
    np.testing.assert_allclose(z, [0, -0.5, np.sqrt(0.75)], atol=1e-12)


def test_the_sagittal_tilt_is_positive_with_the_front_down() -> None:
    _, rotation = one(UPRIGHT, turned(UPRIGHT, 30))
    np.testing.assert_allclose(rotation[:, 2], [0.5, 0, np.sqrt(0.75)], atol=1e-12)


def test_the_end_plates_of_a_wedged_body_are_averaged() -> None:
    wedged = np.array([[20.0, -14], [-20, -10], [20, 10], [-20, 10]])  # tilts atan(0.1) and 0
    _, rotation = one(wedged, UPRIGHT)
    assert -rotation[1, 2] / rotation[2, 2] == pytest.approx(0.05)


def test_the_axial_rotation_follows_stokes() -> None:
    # W / (2 D) = 0.7 and distances a = 8 and b = 12 of the pedicles: tan = 0.7 (12 - 8) / 20 = 0.14.
    _, rotation = one(UPRIGHT, UPRIGHT, np.array([[8.0, 0], [-12, 3]]))
    assert np.arctan2(rotation[1, 0], rotation[0, 0]) == pytest.approx(np.arctan(0.14))
    np.testing.assert_allclose(rotation[:, 2], [0, 0, 1], atol=1e-12)


ANGLES = st.floats(-1.0, 1.0)


@given(ANGLES, ANGLES, ANGLES)
def test_the_angles_of_the_views_make_a_rotation_that_has_them(
    phi: float, theta: float, axial: float
) -> None:
    R = rotation_from_end_plates(*(np.array(angle) for angle in (phi, theta, axial)))
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1)
    z = R[:, 2]
    assert np.arctan2(-z[1], z[2]) == pytest.approx(phi, abs=1e-12)
    assert np.arctan2(z[0], z[2]) == pytest.approx(theta, abs=1e-12)
    trace = np.array([0, np.cos(phi), np.sin(phi)])
    assert trace @ R[:, 0] == pytest.approx(np.sin(axial), abs=1e-12)


@given(st.tuples(ANGLES, ANGLES, ANGLES), st.tuples(*[st.floats(-300, 300)] * 3))
def test_a_pose_comes_back_from_its_projections(
    vector: tuple[float, float, float], place: tuple[float, float, float]
) -> None:
    rotation, position = rotation_from_vector(0.6 * np.array(vector)), np.array(place)
    vertebra = shown_vertebra("T9", position, rotation, 0.7)
    poses = projected_poses(PA, LATERAL, [vertebra], 0.0, 0.01)
    origin = projected_poses(PA, LATERAL, [shown_vertebra("T9", np.zeros(3), rotation, 0.7)], 0.0, 0.01)
    np.testing.assert_allclose(poses.position_mm[0] - origin.position_mm[0], position, atol=1e-9)
    np.testing.assert_allclose(poses.rotation[0], rotation, atol=1e-9)


def test_errors_of_an_upright_body_are_those_computed_by_hand() -> None:
    pedicles = np.array([[10.0, 0], [-10, 0]])
    parameters = VertebraShapeParameters(pedicle_ratio_sd=0.0)
    vertebra = LandmarkedVertebra("T9", UPRIGHT, UPRIGHT, pedicles)
    (factor,) = projected_poses(FRONT, SIDE, [vertebra], 0.0, 0.1, parameters).factors
    variance = np.diag(factor @ factor.T)
    # The mean of four corners has 0.1 / 2 in each view; heights are the mean of two views.
    np.testing.assert_allclose(variance[:3], [0.05**2, 0.05**2, 0.05**2 / 2], rtol=1e-4)
    # A tilt is the sum of two differences of heights over the sum of two widths, 2 x 0.1 / 80.
    tilt = np.degrees(2 * 0.1 / 80)
    np.testing.assert_allclose(variance[3:5], tilt**2, rtol=1e-4)
    # d(tan) = 0.7 d(left + right - 2 centre) / 20, whose deviation is 0.1 sqrt(2 + 4 / 4).
    axial = np.degrees(0.7 * 0.1 * np.sqrt(3) / 20)
    assert variance[5] == pytest.approx(axial**2, rel=1e-4)


def test_the_ratio_of_the_pedicles_has_an_error_that_grows_with_the_rotation() -> None:
    def axial_sd(pedicles: Float) -> float:
        vertebra = LandmarkedVertebra("T9", UPRIGHT, UPRIGHT, pedicles)
        (factor,) = projected_poses(FRONT, SIDE, [vertebra], 0.0, 1e-6).factors
        return float(np.linalg.norm(factor[5]))

    assert axial_sd(np.array([[10.0, 0], [-10, 0]])) < 1e-3
    # tan = k (b - a) / (a + b) with k = 0.7 +- 0.1
    expected = np.degrees(np.arctan(0.8 * 0.2) - np.arctan(0.6 * 0.2)) / 2
    assert axial_sd(np.array([[8.0, 0], [-12, 0]])) == pytest.approx(expected, rel=1e-3)


def test_without_pedicles_the_axial_rotation_is_zero_with_a_large_deviation() -> None:
    shown = shown_vertebra("T9", np.zeros(3), rotation_from_vector(np.array([0.1, 0.2, 0.3])), 0.7)
    vertebra = dataclasses.replace(shown, pedicles_px=None)
    poses = projected_poses(PA, LATERAL, [vertebra], 0.0, 0.5)
    z = poses.rotation[0, :, 2]
    assert np.linalg.norm(z @ poses.factors[0, 3:]) == pytest.approx(20, rel=0.01)
    assert np.isclose(poses.rotation[0, 0, 1], 0)  # y has no part along the line of sight


def test_factors_are_the_scatter_of_repeated_digitizing() -> None:
    exact = scene(1)
    first = projected_poses(
        PA, LATERAL, exact.vertebrae, 0.0, 2.0, VertebraShapeParameters(pedicle_ratio_sd=0)
    )
    errors = []
    for k in range(300):
        vertebrae = seen(exact, 2.0, 1000 + k).vertebrae
        poses = projected_poses(PA, LATERAL, vertebrae, 0.0, 2.0)
        turn = vector_from_rotation(poses.rotation @ np.swapaxes(first.rotation, -1, -2))
        errors.append(np.concatenate([poses.position_mm - first.position_mm, np.degrees(turn)], axis=1))
    scatter = np.mean(np.square(errors), axis=0)
    stated = (first.factors**2).sum(axis=-1)
    assert np.abs(scatter.mean(axis=0) / stated.mean(axis=0) - 1).max() < 0.12


def test_heights_are_reconciled() -> None:
    exact = scene(3)
    heights = shared_heights(PA, LATERAL, exact.vertebrae, exact.common, 1.0)
    assert heights.offset_mm == pytest.approx(HEIGHT_OFFSET_MM)  # below the upper edges of the images
    assert heights.rms_mm == pytest.approx(0, abs=1e-9)
    assert heights.dof == 17 + 8 - 1


def test_a_residual_of_the_heights_is_computed_by_hand() -> None:
    low, high = (
        CommonPoint(name, np.array([0.0, v]), np.array([0.0, w]), np.zeros(3), np.zeros((3, 3)))
        for name, v, w in (("a", 0.0, 0.0), ("b", -100.0, -98.0))
    )
    heights = shared_heights(FRONT, SIDE, [], [low, high], 1.0)
    # Differences 0 and 2: offset 1, residuals -1 and 1, each of variance 2; the slope is 2 mm in 100.
    assert (heights.offset_mm, heights.rms_mm, heights.chi2, heights.dof) == (1.0, 1.0, 1.0, 1)
    assert heights.slope == pytest.approx(0.02)
    assert heights.slope_sd == pytest.approx(np.sqrt(2 / 5000))


def test_common_points_take_each_coordinate_from_the_view_that_shows_it() -> None:
    point = CommonPoint("a", np.array([3.0, -10]), np.array([5.0, -6]), np.zeros(3), np.zeros((3, 3)))
    np.testing.assert_allclose(projected_points(FRONT, SIDE, [point], 4.0), [[5, 3, 10]])
    wide = RadiographView((2.0, 3.0), "left")
    np.testing.assert_allclose(projected_variances(wide, SIDE, 0.1), [0.01, 0.09, 0.05 / 4])


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"pedicle_ratio": 0.0}, "pedicle_ratio and .* must be positive"),
        ({"pedicle_ratio": float("nan")}, "pedicle_ratio and .* must be positive"),
        ({"unknown_rotation_sd_deg": 0.0}, "unknown_rotation_sd_deg must be positive"),
        ({"pedicle_ratio_sd": -1.0}, "pedicle_ratio_sd must not be negative"),
        ({"pedicle_ratio_sd": float("nan")}, "pedicle_ratio_sd must not be negative"),
    ],
)
def test_parameters_outside_their_range_are_refused(wrong: dict[str, float], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        dataclasses.replace(VertebraShapeParameters(), **wrong)


def test_all_vertebrae_may_have_the_same_shape() -> None:
    assert dataclasses.replace(VertebraShapeParameters(), pedicle_ratio_sd=0.0).pedicle_ratio_sd == 0
