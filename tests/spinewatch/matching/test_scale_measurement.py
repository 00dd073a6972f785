from collections.abc import Callable

import numpy as np
import pytest

from spinewatch.arrays import Float
from spinewatch.camera import Rig
from spinewatch.markers import FLAT_10_14_18
from spinewatch.matching.marker_scale import MarkerScale, MarkerScaleParameters
from spinewatch.matching.scale_measurement import MarkerBalls, measure_scale
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.pose import ball_centres

RIG = large_rig()
PARAMETERS = MarkerScaleParameters()


def balls_of(triads: int) -> MarkerBalls:
    number = np.arange(triads)
    pairs = (FLAT_10_14_18.pairs + 3 * number[:, None, None]).reshape(-1, 2)
    return MarkerBalls(np.repeat(number, 3), pairs, np.tile(FLAT_10_14_18.distances_mm, triads))


def scale_of(
    rig: Rig, seed: int, triads: int = 4, sigma: float = 0.1, made: Callable[[Float], Float] = lambda d: d
) -> MarkerScale | None:
    """Return the scale that the calibrated rig measures of images that another one has taken."""
    rng = np.random.default_rng(seed)
    centres = ball_centres(random_spine(rng, triads, spacing_mm=40)).reshape(-1, 3)
    noisy = (
        c.project(centres) + sigma * rng.standard_normal((len(centres), 2)) for c in (rig.left, rig.right)
    )
    left, right = (
        camera.rays(xy, max(sigma, 1e-3) ** 2 * np.eye(2))
        for camera, xy in zip((RIG.left, RIG.right), noisy, strict=True)
    )
    known = balls_of(triads)
    known = MarkerBalls(known.marker, known.pairs, made(known.distances_mm))
    return measure_scale(RIG, (left, right), known, PARAMETERS, (20.0, 20))


def moved(yaw_deg: float = 0.0, base: float = 0.0) -> Rig:
    along = RIG.right.M @ (RIG.right.centre - RIG.left.centre)
    return Rig("moved", RIG.left, RIG.right.moved(np.radians([0, yaw_deg, 0]), base * along))


def drifted(rig: Rig, runs: int = 100) -> float:
    scales = [scale_of(rig, seed) for seed in range(runs)]
    return float(np.mean([scale is not None and scale.drifted for scale in scales]))


def test_a_yaw_of_a_third_of_a_degree_and_a_base_of_one_percent_are_found_from_four_triads() -> None:
    assert drifted(moved(yaw_deg=0.3)) >= 0.95
    assert drifted(moved(base=0.01)) >= 0.95


def test_a_rig_that_has_not_moved_is_not_flagged() -> None:
    assert drifted(RIG, runs=200) <= 0.01


def test_the_explanations_are_the_motion() -> None:
    yaw, base = scale_of(moved(yaw_deg=0.4), 1, sigma=0.0), scale_of(moved(base=0.02), 1, sigma=0.0)
    assert yaw is not None
    assert base is not None
    assert yaw.yaw_deg == pytest.approx(0.4, rel=0.05)
    assert base.base_mm == pytest.approx(0.02 * RIG.baseline_mm, rel=0.05)
    assert base.scale == pytest.approx(1 / 1.02, rel=1e-3)


def test_the_deviations_are_those_of_many_stages() -> None:
    scales = [scale for seed in range(200) if (scale := scale_of(RIG, seed)) is not None]
    errors = np.array([(scale.scale - 1) / scale.sd for scale in scales])
    assert errors.std() == pytest.approx(1, abs=0.15)


def test_markers_of_another_size_are_found() -> None:
    scale = scale_of(RIG, 3, made=lambda distances: distances * 1.02)
    assert scale is not None
    assert scale.drifted
    assert scale.scale < 0.99


def test_one_marker_has_no_scale() -> None:
    assert scale_of(RIG, 0, triads=1) is None
