import numpy as np
import pytest

from spinewatch.arrays import Float
from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.matching.rig_check import check_rig, refined_rig
from spinewatch.simulation.observations import ball_centres
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine

STILL = np.zeros(3)


def images(rig: Rig, seed: int, triads: int = 5, sigma: float = 0.1) -> tuple[Features, Features]:
    rng = np.random.default_rng(seed)
    balls = ball_centres(random_spine(rng, triads, spacing_mm=40)).reshape(-1, 3)
    noisy = (c.project(balls) + sigma * rng.standard_normal((len(balls), 2)) for c in (rig.left, rig.right))
    left, right = (Features.with_sigma(xy, np.ones(len(xy)), sigma) for xy in noisy)
    return left, right


def bumped(turn_deg: Float, shift_mm: Float) -> Rig:
    rig = large_rig()
    return Rig("bumped", rig.left, rig.right.moved(np.radians(turn_deg), shift_mm))


def flagged(rig: Rig, runs: int = 40) -> float:
    checks = [check_rig(large_rig(), *images(rig, seed)) for seed in range(runs)]
    return float(np.mean([check is not None and check.drifted for check in checks]))


def test_a_bump_across_the_epipolar_lines_is_found_from_five_triads() -> None:
    assert flagged(bumped(np.array([0.05, 0, 0]), STILL)) == 1
    assert flagged(bumped(STILL, np.array([0, 0.2, 0]))) > 0.75


def test_a_rig_as_calibrated_is_left_in_peace() -> None:
    assert flagged(large_rig(), runs=200) <= 0.01


def test_the_estimate_says_what_it_cannot_see() -> None:
    check = check_rig(large_rig(), *images(bumped(np.array([0.0, 0.05, 0.0]), STILL), 1))
    assert check is not None
    assert not check.drifted  # a turn about the vertical moves images along the epipolar lines
    assert check.turn_sd_deg[1] > 0.09
    assert check.shift_sd_mm[0] > 0.49
    assert "balls miss" in check.sentence


def test_refinement_brings_the_rays_together_again() -> None:
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


def test_too_few_balls_say_nothing() -> None:
    assert check_rig(large_rig(), *images(large_rig(), 0, triads=1)) is None


def test_a_camera_that_does_not_move_is_the_same() -> None:
    camera = large_rig().right
    assert np.allclose(camera.moved(STILL, STILL).M, camera.M, atol=1e-14)
    assert camera.moved(STILL, np.array([0, 0, 1.0])).centre == pytest.approx(camera.centre + camera.M[2])
