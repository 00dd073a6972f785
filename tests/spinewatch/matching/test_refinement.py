from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from spinewatch.detection.features import Features
from spinewatch.matching.epipolar import CandidatePairs
from spinewatch.matching.refinement import RefinementParameters, feature_windows, refine_candidates
from spinewatch.simulation.rigs import large_rig, small_rig

PARAMETERS = RefinementParameters(enabled=True)


def textured(seed: int) -> NDArray[np.uint8]:
    rng = np.random.default_rng(seed)
    coarse = rng.uniform(0, 255, (26, 36))
    return np.kron(coarse, np.ones((16, 16))).astype(np.uint8)[:416, :568]


def features(*pixels: tuple[float, float]) -> Features:
    return Features.with_sigma(np.array(pixels, dtype=float), np.ones(len(pixels)), 0.3)


def test_windows_are_normalized_and_survive_the_border() -> None:
    at = features((0, 0), (567, 415), (284, 208))
    w = feature_windows(textured(0), at, large_rig().left, 8.0, 700.0, PARAMETERS)
    assert w.shape == (3, 625)
    assert np.allclose(w.mean(axis=1), 0, atol=1e-12)
    assert np.allclose(np.linalg.norm(w, axis=1), 1)


def test_the_same_surroundings_are_kept_and_others_dropped() -> None:
    image = textured(1)
    left = features((200, 200), (350, 150))
    right = features((200, 200), (350, 150))
    pairs = CandidatePairs(np.array([0, 0, 1, 1]), np.array([0, 1, 0, 1]))
    kept = refine_candidates(pairs, (left, right), (image, image), small_rig(), 8.0, PARAMETERS)
    assert kept.left.tolist() == kept.right.tolist() == [0, 1]


def test_flat_surroundings_discard_no_candidate() -> None:
    flat = np.full((416, 568), 90, dtype=np.uint8)
    at = features((200, 200), (350, 150))
    pairs = CandidatePairs(np.array([0, 0, 1]), np.array([0, 1, 1]))
    kept = refine_candidates(pairs, (at, at), (flat, flat), large_rig(), 8.0, PARAMETERS)
    assert len(kept.left) == 3


def test_a_larger_vergence_discards_fewer_candidates() -> None:
    rng = np.random.default_rng(4)
    image = textured(2)
    blurred = np.clip(image * 0.5 + rng.uniform(0, 120, image.shape), 0, 255).astype(np.uint8)
    n = 40
    at = features(*rng.uniform((60, 60), (500, 350), (n, 2)))
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    pairs = CandidatePairs(i, j)
    small, large = (
        len(refine_candidates(pairs, (at, at), (image, blurred), rig, 8.0, PARAMETERS).left)
        for rig in (small_rig(), large_rig())
    )
    assert n <= small < large < n * n


def test_the_window_scales_with_the_diameter_of_the_balls() -> None:
    image, at = textured(3), features((284, 208))
    small, large = (
        feature_windows(image, at, large_rig().left, diameter, 700.0, PARAMETERS)[0].reshape(25, 25)
        for diameter in (8.0, 16.0)
    )
    inner = large[6:19, 6:19]  # the part of the large window that the small one covers
    reduced = small[::2, ::2]
    assert np.corrcoef(inner.ravel(), reduced.ravel())[0, 1] > 0.7


def test_the_fraction_of_the_best_correlation_is_a_parameter() -> None:
    rng = np.random.default_rng(4)
    image = textured(2)
    noisy = np.clip(image * 0.5 + rng.uniform(0, 120, image.shape), 0, 255).astype(np.uint8)
    at = features(*rng.uniform((60, 60), (500, 350), (30, 2)))
    i, j = (a.ravel() for a in np.meshgrid(np.arange(30), np.arange(30), indexing="ij"))
    pairs = CandidatePairs(i, j)
    counts = [
        len(
            refine_candidates(
                pairs,
                (at, at),
                (image, noisy),
                large_rig(),
                8.0,
                replace(PARAMETERS, min_correlation_ratio=(0.8, fraction)),
            ).left
        )
        for fraction in (0.2, 0.5, 0.95)
    ]
    assert counts[0] > counts[1] > counts[2] >= 30
