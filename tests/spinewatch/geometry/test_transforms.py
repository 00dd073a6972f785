import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spinewatch.geometry.rotations import rotation_from_vector, vector_from_rotation
from spinewatch.geometry.transforms import (
    DegeneratePointsError,
    RigidTransform,
    SimilarityTransform,
    approximate_poses,
    fit_rigid,
    fit_similarity,
    rigid_covariance,
)
from spinewatch.markers import FLAT_10_14_18

MODEL = FLAT_10_14_18.coordinates_mm
seeds = st.integers(0, 2**32 - 1)


def random_motion(rng: np.random.Generator) -> RigidTransform:
    return RigidTransform(Rotation.random(rng=rng).as_matrix(), rng.uniform(-500, 500, 3))


@given(seeds)
def test_a_motion_its_inverse_and_their_composition(seed: int) -> None:
    rng = np.random.default_rng(seed)
    first, then, points = random_motion(rng), random_motion(rng), rng.normal(0, 100, (4, 3))
    assert np.allclose(first.inverse()(first(points)), points, atol=1e-9)
    assert np.allclose((then @ first)(points), then(first(points)), atol=1e-9)
    assert np.array_equal(RigidTransform.identity()(points), points)


@given(seeds, st.sampled_from([3, 5]))
def test_a_rigid_motion_is_recovered_from_points_of_a_plane_and_of_space(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    points = MODEL if n == 3 else rng.normal(0, 100, (5, 3))
    motion = random_motion(rng)
    found = fit_rigid(points, motion(points))
    assert np.allclose(found.rotation, motion.rotation, atol=1e-9)
    assert np.allclose(found.translation_mm, motion.translation_mm, atol=1e-7)
    rotation, _ = Rotation.align_vectors(
        found(points) - found(points).mean(axis=0), points - points.mean(axis=0)
    )
    assert np.allclose(found.rotation, rotation.as_matrix(), atol=1e-6)


@given(seeds, st.floats(0.5, 2.0))
def test_a_similarity_is_recovered(seed: int, scale: float) -> None:
    rng = np.random.default_rng(seed)
    motion, points = random_motion(rng), rng.normal(0, 100, (6, 3))
    true = SimilarityTransform(scale, motion.rotation, motion.translation_mm)
    found = fit_similarity(points, true(points))
    assert found.scale == pytest.approx(scale, rel=1e-9)
    assert np.allclose(found.rotation, true.rotation, atol=1e-9)
    assert np.allclose(found(points), true(points), atol=1e-7)


def test_a_similarity_by_hand() -> None:
    square = np.array([[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]])
    turned = np.array([[1.0, 1, 5], [1, 4, 5], [-2, 4, 5], [-2, 1, 5]])  # a quarter turn about z, times 1.5
    found = fit_similarity(square, turned)
    assert found.scale == pytest.approx(1.5)
    assert np.allclose(found.rotation, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-12)
    assert np.allclose(found.translation_mm, [1, 1, 5])


def test_noisy_points_never_give_a_reflection() -> None:
    rng = np.random.default_rng(0)
    for noise in rng.normal(0, 2, (500, 3, 3)):
        assert np.linalg.det(fit_rigid(MODEL, MODEL + noise).rotation) == pytest.approx(1)


@pytest.mark.parametrize("points", [np.outer([0.0, 10.0, 28.0], [1.0, 2.0, 2.0]), np.zeros((3, 3))])
def test_points_on_a_line_determine_no_rotation(points: np.ndarray) -> None:
    with pytest.raises(DegeneratePointsError):
        fit_rigid(MODEL, points)
    with pytest.raises(DegeneratePointsError):
        fit_similarity(points, MODEL)


def test_the_covariance_of_a_fit_is_calibrated() -> None:
    rng = np.random.default_rng(11)
    origin, R = np.array([400.0, 380.0, 90.0]), rotation_from_vector(np.array([0.2, -0.3, 1.0]))
    truth = origin + MODEL @ R.T
    A = rng.normal(0, 0.25, (3, 3, 3))
    S = A @ np.swapaxes(A, -1, -2) + 0.02 * np.eye(3)
    L = np.linalg.cholesky(S)
    chi2 = []
    for _ in range(1500):
        measured = truth + (L @ rng.standard_normal((3, 3, 1)))[..., 0]
        found = fit_rigid(MODEL, measured)
        theta = np.degrees(vector_from_rotation(R @ found.rotation.T))
        e = np.concatenate([origin - found.translation_mm, theta])
        chi2.append(e @ np.linalg.solve(rigid_covariance(found.translation_mm, measured, S), e))
    assert abs(np.mean(chi2) - 6) < 0.5


@given(seeds)
def test_approximate_poses_are_exact_for_exact_points(seed: int) -> None:
    rng = np.random.default_rng(seed)
    motions = [random_motion(rng) for _ in range(4)]
    origin, R = approximate_poses(MODEL, np.stack([motion(MODEL) for motion in motions]))
    assert np.allclose(origin, [motion.translation_mm for motion in motions], atol=1e-9)
    assert np.allclose(R, [motion.rotation for motion in motions], atol=1e-9)
