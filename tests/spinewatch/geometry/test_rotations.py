from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spinewatch.geometry.rotations import (
    angles_from_rotation,
    cross_matrix,
    inverse_left_jacobian,
    left_jacobian,
    nearest_rotation,
    rotation_from_angles,
    rotation_from_vector,
    variance_about,
    vector_from_rotation,
)

vectors = st.lists(st.floats(-1.8, 1.8), min_size=3, max_size=3).map(np.array)
seeds = st.integers(0, 2**32 - 1)


@given(vectors, vectors)
def test_cross_matrix_is_the_cross_product(v: Any, w: Any) -> None:
    assert np.allclose(cross_matrix(v) @ w, np.cross(v, w), atol=1e-12)


@given(vectors)
def test_rotation_vectors_agree_with_scipy(v: Any) -> None:
    R = rotation_from_vector(v)
    assert np.allclose(R, Rotation.from_rotvec(v).as_matrix(), atol=1e-12)
    assert np.allclose(rotation_from_vector(vector_from_rotation(R)), R, atol=1e-12)


@given(seeds)
def test_many_rotations_are_converted_as_one_by_one(seed: int) -> None:
    R = Rotation.random(6, rng=np.random.default_rng(seed)).as_matrix().reshape(2, 3, 3, 3)
    many = vector_from_rotation(R)
    assert many.shape == (2, 3, 3)
    assert np.array_equal(many[1, 2], vector_from_rotation(R[1, 2]))
    assert np.allclose(rotation_from_vector(many), R, atol=1e-12)


@pytest.mark.parametrize("axis", [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0, 0.8], [-0.48, 0.64, 0.6]])
@pytest.mark.parametrize("angle", [1e-9, 1.0, np.pi - 1e-9])
def test_rotation_vectors_keep_their_digits_at_both_ends(axis: Any, angle: float) -> None:
    v = angle * np.array(axis)
    assert np.allclose(vector_from_rotation(Rotation.from_rotvec(v).as_matrix()), v, rtol=1e-6, atol=1e-15)


@pytest.mark.parametrize("scale", [0.0, 1e-6, 0.9e-4, 1.1e-4, 1.0, 3.0])
def test_the_left_jacobian_is_the_derivative_and_has_its_inverse(scale: float) -> None:
    v = scale * np.array([0.48, -0.6, 0.64])
    J, step = left_jacobian(v), 1e-6
    for k, d in enumerate(step * np.eye(3)):
        forward = vector_from_rotation(rotation_from_vector(v + d) @ rotation_from_vector(v).T)
        backward = vector_from_rotation(rotation_from_vector(v - d) @ rotation_from_vector(v).T)
        assert np.allclose((forward - backward) / (2 * step), J[:, k], atol=1e-8)
    assert np.allclose(J @ inverse_left_jacobian(v), np.eye(3), atol=1e-11)


@given(st.floats(-180, 180), st.floats(-89, 89), st.floats(-180, 180))
def test_angles_are_successive_rotations_and_are_recovered(omega: float, phi: float, kappa: float) -> None:
    M = rotation_from_angles(omega, phi, kappa)
    assert np.allclose(
        M, Rotation.from_euler("xyz", [-omega, -phi, -kappa], degrees=True).as_matrix(), atol=1e-12
    )
    assert np.allclose(rotation_from_angles(*angles_from_rotation(M)), M, atol=1e-12)


@pytest.mark.parametrize(
    "covariance", [np.diag([1.0, 4.0, 9.0]), np.array([[2.0, 1, 0], [1, 2, 0], [0, 0, 0]])]
)
def test_the_variance_about_an_axis_is_that_of_the_angle(covariance: Any) -> None:
    vector = np.array([0.3, -0.4, 0.5])
    errors = 1e-3 * np.random.default_rng(1).multivariate_normal(np.zeros(3), covariance, 20_000)
    turned = rotation_from_vector(errors) @ rotation_from_vector(vector)
    # The angle of a rotation of a matrix from its trace.
    angles = np.arccos((np.trace(turned, axis1=1, axis2=2) - 1) / 2)
    assert variance_about(vector, covariance) == pytest.approx(1e6 * angles.var(), rel=0.05)
    assert variance_about(7 * vector, covariance) == pytest.approx(variance_about(vector, covariance))


def test_without_an_axis_the_variance_is_the_largest_one() -> None:
    assert variance_about(np.zeros(3), np.array([[2.0, 1, 0], [1, 2, 0], [0, 0, 1]])) == pytest.approx(3)


def test_a_variance_about_an_axis_is_never_negative() -> None:
    assert variance_about(np.array([1.0, 0, 0]), np.diag([-1e-18, 1.0, 1.0])) == 0
    assert variance_about(np.zeros(3), -1e-18 * np.eye(3)) == 0


@given(seeds)
def test_the_nearest_rotation_of_a_noisy_one_is_a_rotation_near_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    R = Rotation.random(rng=rng).as_matrix()
    near = nearest_rotation(R + 1e-3 * rng.standard_normal((3, 3)))
    assert np.allclose(near @ near.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(near) == pytest.approx(1)
    assert np.abs(near - R).max() < 1e-2
