"""Errors of the patient axes: their covariance from simulated mistakes, and what they do to poses."""

import numpy as np
import pytest

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector, vector_from_rotation
from spinewatch.spine.axes_errors import (
    axes_factor,
    direction_axes_covariance,
    landmark_axes_covariance,
    turning,
)
from spinewatch.spine.patient_axes import PatientAxesError, axes_from_directions, axes_from_landmarks
from tests.spinewatch.spine.simulated import turn

DRAWS = 4000


def covariance_of(true: Float, others: list[Float]) -> Float:
    """Return the mean square of the rotations from other axes to the true ones, degrees^2."""
    vectors = np.degrees(vector_from_rotation(np.swapaxes(np.array(others), -1, -2) @ true))
    return np.asarray(vectors.T @ vectors / len(vectors))


@pytest.mark.parametrize("left", [[0.0, 1.0, 0.0], [0.2, 1.5, 0.9]])
def test_the_covariance_of_directions_is_that_of_simulated_mistakes(left: list[float]) -> None:
    rng, cephalad, aside = np.random.default_rng(1), np.array([0.1, 0.0, 2.0]), np.array(left)
    expected = direction_axes_covariance(cephalad, aside, 1.0, 2.0)
    drawn = [
        axes_from_directions(
            rotation_from_vector(np.radians(1.0) * rng.standard_normal(3)) @ cephalad,
            rotation_from_vector(np.radians(2.0) * rng.standard_normal(3)) @ aside,
        )
        for _ in range(DRAWS)
    ]
    found = covariance_of(axes_from_directions(cephalad, aside), drawn)
    assert np.allclose(found, expected, atol=0.08 * expected.max())


def test_the_covariance_of_landmarks_is_that_of_simulated_mistakes() -> None:
    rng = np.random.default_rng(2)
    points = np.array([[0.0, 0, 0], [-380.0, 10, 20], [-150.0, -110, 5]])
    caudal, cephalad, left = points
    expected = landmark_axes_covariance(caudal, cephalad, left, 4.0)
    drawn = [axes_from_landmarks(*(points + 4.0 * rng.standard_normal((3, 3)))) for _ in range(DRAWS)]
    found = covariance_of(axes_from_landmarks(*points), drawn)
    assert np.allclose(found, expected, atol=0.08 * expected.max())
    assert np.sqrt(expected[2, 2]) > 2 * np.sqrt(expected[0, 0])


def test_directions_and_landmarks_that_determine_no_axes_have_no_covariance() -> None:
    up = np.array([0.0, 0, 1])
    with pytest.raises(PatientAxesError):
        direction_axes_covariance(up, -up, 3.0, 3.0)
    with pytest.raises(PatientAxesError):
        landmark_axes_covariance(np.zeros(3), 400 * up, 200 * up, 5.0)


def test_turning_is_a_finite_difference() -> None:
    position = np.array([[30.0, -20, 250], [np.nan] * 3, [0.0, 0, 0]])
    J = turning(position)
    e = np.array([1e-4, -2e-4, 3e-4])
    moved = position[0] @ turn(*e).T
    assert np.allclose(J[0, :3] @ e, moved - position[0], atol=1e-7)
    assert np.array_equal(J[0, 3:], np.eye(3))
    assert not J[1].any()


def test_exact_axes_have_no_columns() -> None:
    assert axes_factor(np.zeros((3, 3))).shape == (3, 0)
    F = axes_factor(np.diag([1.0, 4.0, 9.0]))
    assert np.allclose(F @ F.T, np.diag([1.0, 4.0, 9.0]))
