from itertools import permutations
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spinewatch.arrays import Float
from spinewatch.markers import FLAT_10_14_18, TriadModel
from spinewatch.matching.identification import (
    IdentificationParameters,
    distance_chi2,
    distance_errors,
    identify_triads,
    log_gate_volume,
    pairs_at_distances,
)
from spinewatch.matching.points import Points

MODEL = FLAT_10_14_18


def points_at(positions: Any, left: Any = None, right: Any = None, sd: float = 0.3) -> Points:
    n = len(positions)
    index = np.arange(n)
    return Points(
        np.asarray(positions, dtype=float),
        np.tile(np.eye(3) * sd**2, (n, 1, 1)),
        index if left is None else np.asarray(left),
        index if right is None else np.asarray(right),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.ones(n),
    )


def scattered(seed: int, triads: Any = 3, others: int = 60) -> Float:
    rng = np.random.default_rng(seed)
    R = Rotation.random(triads, rng=rng).as_matrix()
    P = rng.uniform(0, 200, (triads, 1, 3))
    balls = P + MODEL.coordinates_mm @ np.swapaxes(R, -1, -2) + rng.normal(0, 0.2, (triads, 3, 3))
    return np.concatenate([balls.reshape(-1, 3), rng.uniform(0, 200, (others, 3))])


def brute_force(positions: Any, tolerance: float) -> set[tuple[int, int, int]]:
    found = set()
    for triple in permutations(range(len(positions)), 3):
        if np.all(np.abs(distance_errors(positions[list(triple)], MODEL)) < tolerance):
            found.add(triple)
    return found


@pytest.mark.parametrize("seed", range(4))
def test_exactly_the_triplets_within_tolerance_are_found(seed: int) -> None:
    positions = scattered(seed, others=14)
    parameters = IdentificationParameters(tolerance_mm=4.0, significance=0.0)
    found = identify_triads(points_at(positions), MODEL, parameters)
    assert {tuple(t) for t in found.point.tolist()} == brute_force(positions, 4.0)
    errors = np.linalg.norm(distance_errors(positions[found.point], MODEL), axis=1)
    assert np.allclose(found.error_mm, errors)
    assert {(0, 1, 2), (3, 4, 5), (6, 7, 8)} <= {tuple(t) for t in found.point.tolist()}


def test_the_covariance_gate_keeps_true_triads_and_discards_chance_tuples() -> None:
    positions = scattered(9, triads=10, others=200)
    gated = identify_triads(points_at(positions, sd=0.2), MODEL, IdentificationParameters())
    free = identify_triads(points_at(positions, sd=0.2), MODEL, IdentificationParameters(significance=0.0))
    true = {(3 * k, 3 * k + 1, 3 * k + 2) for k in range(10)}
    assert true <= {tuple(t) for t in gated.point.tolist()}
    assert len(gated) < len(free)
    assert np.all(np.diff(gated.distance_chi2) >= 0)


def test_true_errors_follow_their_chi2() -> None:
    rng = np.random.default_rng(3)
    n = 800
    R = Rotation.random(n, rng=rng).as_matrix()
    balls = 1000.0 * np.arange(n)[:, None, None] + MODEL.coordinates_mm @ np.swapaxes(R, -1, -2)
    balls = balls + rng.normal(0, 0.3, balls.shape)
    parameters = IdentificationParameters(significance=0.0, model_sd_mm=0.0)
    found = identify_triads(points_at(balls.reshape(-1, 3), sd=0.3), MODEL, parameters)
    ordered = np.all(found.point % 3 == [0, 1, 2], axis=1)
    assert ordered.sum() == n
    assert abs(found.distance_chi2[ordered].mean() - 3) < 0.3


def test_h1_is_applied_to_either_image() -> None:
    balls = MODEL.coordinates_mm
    whole = IdentificationParameters(significance=0.0)
    for shared in ([0, 0, 2], [0, 1, 0], [0, 1, 1]):
        assert len(identify_triads(points_at(balls, left=shared), MODEL, whole)) == 0
        assert len(identify_triads(points_at(balls, right=shared), MODEL, whole)) == 0
        assert len(identify_triads(points_at(balls, left=shared), MODEL, whole, distinct_features=False)) > 0


@pytest.mark.parametrize("n", [0, 1, 2])
def test_too_few_points_contain_no_triad(n: int) -> None:
    assert len(identify_triads(points_at(np.zeros((n, 3))), MODEL, IdentificationParameters())) == 0


def test_a_larger_deviation_of_the_markers_as_made_lowers_the_chi2() -> None:
    positions = scattered(9, triads=1, others=0)
    exact, loose = (
        identify_triads(
            points_at(positions), MODEL, IdentificationParameters(significance=0.0, model_sd_mm=sd)
        )
        for sd in (0.0, 1.0)
    )
    assert loose.distance_chi2[0] < exact.distance_chi2[0]


def test_pairs_at_a_distance_are_found_in_both_orders() -> None:
    positions = np.array([[0.0, 0, 0], [10, 0, 0], [0, 20, 0]])
    near, far = pairs_at_distances(points_at(positions), np.array([10.0, 20.0]), 0.5)
    assert sorted(map(tuple, near.tolist())) == [(0, 1), (1, 0)]
    assert sorted(map(tuple, far.tolist())) == [(0, 2), (2, 0)]


def test_the_gate_of_one_dimension_is_an_interval_of_the_normal_distribution() -> None:
    assert np.exp(log_gate_volume(1, 0.05)) == pytest.approx(2 * 1.959964, abs=1e-5)


def test_a_mirror_image_of_four_balls_is_discarded() -> None:
    body = TriadModel(
        "body", tuple("ABCD"), np.array([[18.0, 0, 0], [0, -15, 0], [-13, 0, 0], [-4, 18, 8]]), 8.0
    )
    balls = body.coordinates_mm + 100
    assert len(identify_triads(points_at(balls), body, IdentificationParameters())) == 1
    assert len(identify_triads(points_at(balls * [1, 1, -1]), body, IdentificationParameters())) == 0


def test_no_distance_of_a_tuple_has_a_larger_chi2_than_the_tuple() -> None:
    points, p = points_at(scattered(3, triads=2, others=6)), IdentificationParameters()
    found = identify_triads(points, MODEL, p)
    assert len(found)
    for (a, b), distance in zip(MODEL.pairs, MODEL.distances_mm, strict=True):
        alone = distance_chi2(points, found.point[:, [a, b]], distance, p.model_sd_mm)
        assert (alone <= found.distance_chi2 + 1e-9).all()
