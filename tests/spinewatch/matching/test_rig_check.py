import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chi2

from spinewatch.arrays import Float
from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.markers import FLAT_10_14_18
from spinewatch.matching.rig_check import RigCheckParameters, check_rig, refined_rig
from spinewatch.matching.scale_measurement import MarkerBalls
from spinewatch.simulation.observations import FeatureNoise
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.scenes import SceneParameters, simulate_scene
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.pose import ball_centres

STILL = np.zeros(3)
RIG = large_rig()
SHARED = SceneParameters(noise=FeatureNoise(0.1, 0.13), calibration_sd_deg=0.003, calibration_sd_mm=0.03)


def images(rig: Rig, seed: int, triads: int = 5, sigma: float = 0.1) -> tuple[Features, Features]:
    rng = np.random.default_rng(seed)
    balls = ball_centres(random_spine(rng, triads, spacing_mm=40)).reshape(-1, 3)
    noisy = (c.project(balls) + sigma * rng.standard_normal((len(balls), 2)) for c in (rig.left, rig.right))
    left, right = (Features.with_sigma(xy, np.ones(len(xy)), sigma) for xy in noisy)
    return left, right


def bumped(rotation_deg: Float, shift_mm: Float) -> Rig:
    rig = large_rig()
    return Rig("bumped", rig.left, rig.right.moved(np.radians(rotation_deg), shift_mm))


def flagged(rig: Rig, runs: int = 40) -> float:
    checks = [check_rig(large_rig(), *images(rig, seed)) for seed in range(runs)]
    return float(np.mean([check is not None and check.drifted for check in checks]))


def test_a_bump_across_the_epipolar_lines_is_found_from_five_triads() -> None:
    assert flagged(bumped(np.array([0.05, 0, 0]), STILL)) == 1
    assert flagged(bumped(STILL, np.array([0, 0.4, 0]))) > 0.75


def test_a_rig_without_drift_is_not_flagged() -> None:
    assert flagged(large_rig(), runs=200) <= 0.01


def test_an_error_that_the_balls_of_a_marker_share_is_no_drift() -> None:
    drifted, p_values = 0, []
    for seed in range(60):
        scene = simulate_scene(RIG, SHARED, np.random.default_rng([8, seed]))
        seen = scene.observation
        left = seen.left.take(np.argsort(seen.left_ball))
        right = seen.right.take(np.argsort(seen.right_ball))
        markers = MarkerBalls(np.repeat(np.arange(4), 3), np.empty((0, 2), dtype=np.intp), np.empty(0))
        check, alone = check_rig(scene.rig, left, right, None, markers), check_rig(scene.rig, left, right)
        assert check is not None
        assert alone is not None
        drifted += check.drifted
        p_values.append((check.p_value, alone.p_value))
    assert drifted <= 1
    assert np.median(p_values, axis=0)[0] > np.median(p_values, axis=0)[1]


def test_the_scale_of_the_markers_makes_a_drift_too() -> None:
    left, right = images(bumped(np.array([0, 0.5, 0]), STILL), 1)
    markers = MarkerBalls(
        np.repeat(np.arange(5), 3),
        np.concatenate([FLAT_10_14_18.pairs + 3 * t for t in range(5)]),
        np.tile(FLAT_10_14_18.distances_mm, 5),
    )
    check = check_rig(large_rig(), left, right, None, markers)
    assert check is not None
    assert (check.off_epipolar, check.drifted) == (False, True)
    assert check.message.startswith("markers measured 0.98")
    assert check.message.endswith("; calibrate again")


def test_motions_along_the_epipolar_lines_keep_the_deviation_of_the_prior() -> None:
    check = check_rig(large_rig(), *images(bumped(np.array([0.0, 0.05, 0.0]), STILL), 1))
    assert check is not None
    assert not check.drifted  # a rotation about the vertical moves images along the epipolar lines
    assert check.rotation_sd_deg[1] > 0.09
    assert check.shift_sd_mm[0] > 0.49
    assert "15 balls are" in check.message


def test_the_refined_rig_satisfies_the_epipolar_geometry() -> None:
    true = bumped(np.array([0.06, 0.0, 0.0]), STILL)
    check = check_rig(large_rig(), *images(true, 3, triads=7))
    assert check is not None
    assert check.rms_px > 0.5
    better = refined_rig(large_rig(), check)
    again = check_rig(better, *images(true, 4, triads=7))
    assert again is not None
    assert again.rms_px < 0.25
    assert not again.drifted
    assert better.name.endswith("(refined)")


def test_too_few_balls_give_no_check() -> None:
    assert check_rig(large_rig(), *images(large_rig(), 0, triads=1)) is None


def test_observed_residuals_scale_the_stated_deviations() -> None:
    rng = np.random.default_rng(6)
    balls = ball_centres(random_spine(rng, 8, spacing_mm=40)).reshape(-1, 3)
    left, right = (
        Features.with_sigma(c.project(balls) + 0.5 * rng.standard_normal((24, 2)), np.ones(24), 0.1)
        for c in (large_rig().left, large_rig().right)
    )
    checks = [
        check_rig(large_rig(), left, right, RigCheckParameters(covariance_dof=dof)) for dof in (0, 20, 10**6)
    ]
    p_values = [check.p_value for check in checks if check is not None]
    assert p_values == sorted(p_values, reverse=True)
    assert p_values[0] > 1e-3 > p_values[2]  # with the stated deviations alone, noise is taken for a drift


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_without_noise_the_residuals_vanish(seed: int) -> None:
    check = check_rig(large_rig(), *images(large_rig(), seed, sigma=1e-9))
    assert check is not None
    assert check.rms_px < 1e-6
    assert np.abs(check.rotation_deg).max() < 1e-3


def test_the_p_value_is_that_of_the_chi2() -> None:
    check = check_rig(large_rig(), *images(bumped(np.array([0.02, 0, 0]), STILL), 2))
    assert check is not None
    assert check.p_value == pytest.approx(chi2.sf(check.chi2, check.dof))
    assert 1 <= check.dof <= 5
