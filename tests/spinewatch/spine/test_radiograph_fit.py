"""The seven-parameter fit: exact cases, its covariance and its tests of scale and points."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector, vector_from_rotation
from spinewatch.spine.radiograph_fit import (
    CommonPointsError,
    RadiographFitParameters,
    RadiographScaleError,
    SimilarityFit,
    chi2_p_value,
    disagreement,
    fit_common_points,
    fit_flags,
)

NAMES = [f"screw {k}" for k in range(8)]
POINTS = np.random.default_rng(5).uniform(-100, 100, (8, 3)) * [0.4, 0.5, 2.0]
VARIANCES = np.array([0.09, 0.04, 0.02])
ROTATION = rotation_from_vector(np.array([0.5, -1.0, 2.0]))
TRANSLATION = np.array([300.0, -20.0, 900.0])


def moved(points: Float, scale: float = 1.0) -> Float:
    return np.asarray(scale * points @ ROTATION.T + TRANSLATION)


def covariances(count: int, sd: float = 0.3) -> Float:
    return np.tile(sd**2 * np.eye(3), (count, 1, 1))


def fitted(source: Float, target: Float, count: int = 8) -> SimilarityFit:
    return fit_common_points(NAMES[:count], source[:count], VARIANCES, target[:count], covariances(count))


def noisy(seed: int, scale: float = 1.0, count: int = 8) -> SimilarityFit:
    random = np.random.default_rng(seed)
    source = POINTS + np.sqrt(VARIANCES) * random.standard_normal(POINTS.shape)
    return fitted(source, moved(POINTS, scale) + 0.3 * random.standard_normal(POINTS.shape), count)


@given(
    st.floats(0.5, 2.0),
    st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    st.tuples(*[st.floats(-1e3, 1e3)] * 3),
    st.integers(3, 8),
)
def test_an_exact_similarity_is_recovered(
    scale: float, vector: tuple[float, ...], shift: tuple[float, ...], count: int
) -> None:
    R = rotation_from_vector(np.array(vector))
    fit = fitted(POINTS, scale * POINTS @ R.T + np.array(shift), count)
    assert fit.transform.scale == pytest.approx(scale, rel=1e-9)
    np.testing.assert_allclose(fit.transform.rotation, R, atol=1e-9)
    np.testing.assert_allclose(fit.transform.translation_mm, shift, atol=1e-6)
    assert fit.rms_mm < 1e-9
    assert fit.dof == 3 * count - 7


@given(st.permutations(range(8)), st.integers(0, 50))
def test_the_order_of_the_points_does_not_matter(order: list[int], seed: int) -> None:
    random = np.random.default_rng(seed)
    target = moved(POINTS) + random.standard_normal(POINTS.shape)
    one = fit_common_points(NAMES, POINTS, VARIANCES, target, covariances(8))
    names = [NAMES[k] for k in order]
    two = fit_common_points(names, POINTS[order], VARIANCES, target[order], covariances(8))
    assert two.transform.scale == pytest.approx(one.transform.scale, rel=1e-12)
    np.testing.assert_allclose(two.covariance, one.covariance, atol=1e-12)
    distances = {point.name: point.distance_mm for point in one.residuals}
    for point in two.residuals:
        assert point.distance_mm == pytest.approx(distances[point.name])


def test_the_covariance_of_a_square_is_that_computed_by_hand() -> None:
    """Four points at 100 mm from their centroid, in a plane; errors of 1 mm per axis in object space alone."""
    source = 100 * np.array([[1.0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
    fit = fit_common_points(NAMES[:4], source, np.zeros(3), moved(source), covariances(4, 1.0))
    np.testing.assert_allclose(fit.translation_sd_mm, 0.5)  # mean of four
    assert fit.scale_sd == pytest.approx(1 / np.sqrt(4e4))  # sum of squared radii
    S = ROTATION.T @ fit.covariance[3:6, 3:6] @ ROTATION
    np.testing.assert_allclose(S, np.diag([1 / 2e4, 1 / 2e4, 1 / 4e4]), atol=1e-12)


def test_stated_errors_are_those_of_repeated_measurement() -> None:
    errors, covariance, squares, single = [], noisy(0).covariance, [], []
    for seed in range(600):
        fit = noisy(seed)
        centre = moved(POINTS.mean(axis=0)[None])[0]
        errors.append(
            [
                *(fit.transform(POINTS.mean(axis=0)[None])[0] - centre),
                *vector_from_rotation(fit.transform.rotation @ ROTATION.T),
                np.log(fit.transform.scale),
            ]
        )
        squares.append(fit.chi2)
        single.append([point.chi2 for point in fit.residuals])
    whitened = np.einsum("ni,ij,nj->n", errors, np.linalg.inv(covariance), errors)
    assert whitened.mean() == pytest.approx(7, rel=0.08)
    assert np.mean(squares) == pytest.approx(17, rel=0.04)
    assert np.mean(single) == pytest.approx(3, rel=0.06)


def test_the_error_of_a_pose_is_that_of_the_transform_at_its_place() -> None:
    fit = noisy(1)
    factor = fit.pose_factor(np.array([fit.centre_mm, fit.centre_mm + np.array([100.0, 0, 0])]))
    S = factor @ np.swapaxes(factor, -1, -2)
    np.testing.assert_allclose(S[0, :3, :3], fit.covariance[:3, :3], atol=1e-12)
    np.testing.assert_allclose(np.sqrt(np.diag(S[1])[3:]), fit.rotation_sd_deg)
    # 100 mm along X: scale along X, rotation about Z along Y and about Y along Z
    arm = np.array([[1, 0, 0, 0, 0, 0, 100.0], [0, 1, 0, 0, 0, 100, 0], [0, 0, 1, 0, -100, 0, 0]])
    np.testing.assert_allclose(S[1, :3, :3], arm @ fit.covariance @ arm.T, atol=1e-9)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_too_few_points_are_refused(count: int) -> None:
    with pytest.raises(CommonPointsError, match="at least three"):
        fitted(POINTS, moved(POINTS), count)


LINE = np.outer(np.linspace(-100, 100, 8), [0.1, 0.2, 1.0])


@pytest.mark.parametrize("points", [LINE, np.zeros((8, 3)), np.ones((8, 3)) * 7])
def test_points_on_a_line_or_together_are_refused(points: Float) -> None:
    with pytest.raises(CommonPointsError, match="one line"):
        fitted(points, moved(points))


@pytest.mark.parametrize("seed", range(20))
def test_points_on_a_line_but_for_their_errors_are_refused(seed: int) -> None:
    random = np.random.default_rng(seed)
    source = LINE + np.sqrt(VARIANCES) * random.standard_normal(LINE.shape)
    target = moved(LINE) + 0.3 * random.standard_normal(LINE.shape)
    with pytest.raises(CommonPointsError, match="one line"):
        fitted(source, target)


@pytest.mark.parametrize(
    ("scale", "codes"), [(1.0, []), (1.021, ["radiograph-scale"]), (0.97, ["radiograph-scale"])]
)
def test_a_scale_from_two_percent_is_flagged_with_its_numbers(scale: float, codes: list[str]) -> None:
    flags = fit_flags(fitted(POINTS, moved(POINTS, scale)))
    assert [flag.code for flag in flags] == codes
    assert all(f"{scale:.4f}" in flag.detail for flag in flags)


def test_a_smaller_scale_is_flagged_when_it_is_significant() -> None:
    fit = fitted(POINTS, moved(POINTS, 1.008))
    assert fit.scale_sd < 0.008 / 3.3
    assert [flag.code for flag in fit_flags(fit)] == ["radiograph-scale"]
    rough = dataclasses.replace(fit, covariance=16 * fit.covariance)
    assert fit_flags(rough) == ()


@pytest.mark.parametrize("scale", [0.94, 1.06, 25.4])
def test_a_scale_beyond_five_percent_is_refused(scale: float) -> None:
    with pytest.raises(RadiographScaleError, match="pixel spacing at the patient"):
        fit_flags(fitted(POINTS, moved(POINTS, scale)))


def test_a_scale_just_within_five_percent_is_not_refused() -> None:
    assert [flag.code for flag in fit_flags(fitted(POINTS, moved(POINTS, 1.049)))] == ["radiograph-scale"]


@pytest.mark.parametrize("index", range(8))
def test_a_blunder_is_named(index: int) -> None:
    target = moved(POINTS)
    target[index] += [4.0, -5.0, 6.0]
    fit = fitted(POINTS, target)
    assert [point.name for point in fit.residuals if point.blunder] == [NAMES[index]]
    flag = next(flag for flag in fit_flags(fit) if flag.code == "radiograph-point-doubtful")
    assert NAMES[index] in flag.detail


def test_of_three_points_none_is_named() -> None:
    target = moved(POINTS[:3])
    target[1] += [0.0, 8.0, 0.0]
    source = POINTS[:3]
    fit = fit_common_points(NAMES[:3], source, VARIANCES, target, covariances(3))
    assert not any(point.blunder for point in fit.residuals)
    assert fit.dof == 2
    assert fit.residuals[0].dof == 2


def test_points_that_disagree_together_enlarge_the_errors() -> None:
    random = np.random.default_rng(3)
    fit = fitted(POINTS, moved(POINTS) + 2.0 * random.standard_normal(POINTS.shape))
    assert not any(point.blunder for point in fit.residuals) or fit.chi2 > 17
    assert disagreement(fit) == pytest.approx(np.sqrt(fit.chi2 / 17))
    assert disagreement(noisy(2)) == 1.0
    quiet = dataclasses.replace(fit, residuals=noisy(2).residuals)
    assert fit_flags(quiet)[0].code == "radiograph-points-disagree"


def test_sound_points_are_rarely_flagged() -> None:
    raised = [flag.code for seed in range(500) for flag in fit_flags(noisy(seed))]
    assert len(raised) <= 6  # three tests at 0.001 each: 1.5 expected


@given(st.floats(0, 500), st.integers(1, 200))
def test_the_p_value_is_that_of_scipy(value: float, dof: int) -> None:
    assert chi2_p_value(value, dof) == pytest.approx(chi2.sf(value, dof), rel=1e-9, abs=1e-300)


def test_limits_can_be_set() -> None:
    fit = fitted(POINTS, moved(POINTS, 1.1))
    assert fit_flags(fit, RadiographFitParameters(refused_scale=0.2))[0].code == "radiograph-scale"
