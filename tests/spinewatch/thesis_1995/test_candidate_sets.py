import numpy as np
import pytest

from spinewatch.detection.features import Features
from spinewatch.geometry.rays import Rays
from spinewatch.simulation.rigs import large_rig
from spinewatch.thesis_1995.candidate_sets import (
    CandidateSetParameters,
    CandidateSets,
    candidate_sets,
    feature_windows,
    refine_sets,
)

RIG = large_rig()
PARAMETERS = CandidateSetParameters()


def rays_of(points_mm: np.ndarray, shift_px: float = 0.0) -> tuple[Rays, ...]:
    left, right = (camera.project(points_mm) for camera in (RIG.left, RIG.right))
    right = right + np.array([0.0, shift_px])
    return tuple(
        Features.with_sigma(xy, np.ones(len(xy)), 0.1).rays(camera)
        for xy, camera in ((left, RIG.left), (right, RIG.right))
    )


@pytest.mark.parametrize(("shift_px", "near"), [(0.0, True), (2.0, True), (6.0, False)])
def test_a_candidate_is_within_the_tolerance_of_the_segment_in_both_directions(
    shift_px: float, near: bool
) -> None:
    left, right = rays_of(np.array([[430.0, 390.0, 90.0]]), shift_px)
    sets = candidate_sets(left, right, RIG, PARAMETERS)
    assert sets.of_left.item() is near
    assert sets.of_right.item() is near


def test_a_point_out_of_range_has_no_candidate() -> None:
    left, right = rays_of(np.array([[430.0, 390.0, 480.0]]))
    assert not candidate_sets(left, right, RIG, PARAMETERS).pairs.any()


def test_refinement_keeps_what_exceeds_a_fraction_of_the_greatest_correlation_of_its_set() -> None:
    rng = np.random.default_rng(3)
    image = rng.integers(0, 255, (200, 300)).astype(np.uint8)
    left = Features.with_sigma(np.array([[60.0, 60.0], [200.0, 90.0]]), np.ones(2), 0.1)
    right = Features.with_sigma(np.array([[60.0, 60.0], [150.0, 120.0], [200.0, 90.0]]), np.ones(3), 0.1)
    everything = CandidateSets(np.ones((2, 3), bool), np.ones((2, 3), bool))
    refined, rho = refine_sets(everything, (left, right), (image, image), PARAMETERS)
    assert refined.of_left.tolist() == [[True, False, False], [False, False, True]]
    assert rho[[0, 1], [0, 2]] == pytest.approx([1.0, 1.0])
    # the right feature in the middle has no similar partner: the better of its two stays
    assert refined.of_right[:, 1].sum() >= 1


def test_windows_at_the_border_repeat_it_and_flat_ones_correlate_with_nothing() -> None:
    flat = np.full((40, 50), 9, np.uint8)
    assert np.all(feature_windows(flat, np.array([[0.0, 0.0], [49.0, 39.0]]), 75) == 0)
