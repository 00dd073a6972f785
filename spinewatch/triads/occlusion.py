"""Candidate triads with a hidden ball.

Two balls that both images show leave a triad free to rotate about the line through them. The image of the third ball in
one view determines this rotation: the circle on which the ball must lie is imaged near that feature once or twice. Ten
image coordinates for six unknowns leave four degrees of freedom for a test of the fit, where a triad in full view has
six, so that the chain of triads has more weight in the selection of these. Two balls alone have no pose; they are
selected only if the chain makes a triad there likely. A marker of four balls that lacks one is a triad of three balls.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.camera import Rig
from spinewatch.detection.features import HIDDEN
from spinewatch.geometry.rays import Rays
from spinewatch.geometry.transforms import approximate_poses
from spinewatch.markers import TriadModel
from spinewatch.matching.identification import (
    IdentificationParameters,
    chi2_limit,
    identify_triads,
    log_gate_volume,
)
from spinewatch.matching.points import Points
from spinewatch.matching.rating import rate_triplets, score_log_odds, tilt_log_odds
from spinewatch.matching.selection_parameters import SelectionParameters
from spinewatch.matching.triad_candidates import MAX_BALLS, TriadCandidates, pad_features
from spinewatch.triads.ball_pairs import BallPairs, ball_pairs, pair_candidates
from spinewatch.triads.pose_adjustment import PoseAdjustmentParameters, adjust_poses, triad_images
from spinewatch.triads.third_ball import Circles, features_near_circles, third_ball_circles

_DOF = 4
"""Five ball images of two coordinates less the six parameters of a pose."""


def _few_steps() -> PoseAdjustmentParameters:
    return PoseAdjustmentParameters(max_steps=5)


@dataclass(frozen=True)
class OcclusionParameters:
    """Limits and prior knowledge of triads with a hidden ball.

    Attributes
    ----------
    enabled
        Whether triads with a hidden ball are searched for.
    tolerance_mm
        Largest error of the distance between the two balls in full view, mm.
    max_circle_distance_mrad
        Largest distance of the third ball's image from the circle on which the ball must lie, mrad.
    n_circle_points
        Number of points that represent this circle.
    min_circle_depth
        Smallest distance of the two initial positions of the third ball from the middle of the circle along the line of
        sight, as a fraction of the radius; keeps them apart where the line of sight touches the circle.
    significance
        Probability that the chi-square tests of the distance and of the fit each discard a true triad.
    occluded_rate
        Fraction of the missing triads of which exactly one ball image is hidden; prior for the selection.
    pair_rate
        Fraction of the missing triads of which both images show two balls and neither shows the third.
    assumed_missing
        Number of missing triads assumed when the number of triads is not known.
    extra_sd_mrad
        Pointing error per axis added to every ray, mrad; smaller than that of `MatchingParameters`, since large errors
        would not distinguish the two poses that may fit.
    max_candidates
        Number of candidates that are fitted per pair of balls and image, the nearest to the circle first, and that are
        returned per marker, the most likely first.
    max_pairs
        Number of candidates with two balls that are returned per marker, the most likely first.
    selected_log_odds
        Log-odds of triads in full view in the repeated selection, so large that they stay selected.
    adjustment
        Adjustment of poses.
    """

    enabled: bool = True
    tolerance_mm: float = 3.0
    max_circle_distance_mrad: float = 4.0
    n_circle_points: int = 24
    min_circle_depth: float = 0.2
    significance: float = 0.001
    occluded_rate: float = 0.3
    pair_rate: float = 0.1
    assumed_missing: int = 1
    extra_sd_mrad: float = 0.1
    max_candidates: int = 200
    max_pairs: int = 60
    selected_log_odds: float = 1e4
    adjustment: PoseAdjustmentParameters = field(default_factory=_few_steps)


@dataclass(frozen=True, eq=False)
class FreeFeatures:
    """Features that no triad uses yet.

    Attributes
    ----------
    points
        Points triangulated from free features.
    rays
        Rays of all features of the left and the right image.
    free
        Indices of the free ones among them, shapes (l,) and (r,).
    """

    points: Points
    rays: tuple[Rays, Rays]
    free: tuple[Int, Int]


@dataclass(frozen=True, eq=False)
class _Problem:
    """What every step of the search needs."""

    features: FreeFeatures
    rig: Rig
    identification: IdentificationParameters
    selection: SelectionParameters
    occlusion: OcclusionParameters

    @property
    def points(self) -> Points:
        """Points of free features."""
        return self.features.points


@dataclass(frozen=True, eq=False)
class _InitialTriads:
    """Triads before their fit.

    Balls (c, 3, 3), mm; left and right features (c, 3); log-odds of the scores (c,); distances of the third ball's
    image from its circle (c,), image plane, mm.
    """

    balls_mm: Float
    left: Int
    right: Int
    log_odds: Float
    circle_distance_mm: Float


def occluded_candidates(
    features: FreeFeatures,
    rig: Rig,
    models: Sequence[TriadModel],
    identification: IdentificationParameters,
    selection: SelectionParameters,
    parameters: OcclusionParameters,
    missing: int | None,
) -> TriadCandidates:
    """Return candidate triads with a hidden ball.

    Parameters
    ----------
    features
        Features that may be used.
    rig
        The calibrated cameras.
    models
        The markers.
    identification
        Limits of distances, and the standard deviation of a marker's distances.
    selection
        Prior knowledge of triads.
    parameters
        Limits and prior knowledge of triads with a hidden ball.
    missing
        Number of triads still expected; None if it is not known, then pairs of balls are not returned.

    Returns
    -------
    TriadCandidates
        Candidates of each marker and kind, the most likely first; of two poses with the same features the more likely
        one.

    References
    ----------
    Not in the thesis, which needs all balls in both images.

    Examples
    --------
    >>> from spinewatch.markers import FLAT_10_14_18
    >>> from spinewatch.matching.points import MatchingParameters, match_features
    >>> from spinewatch.simulation.observations import FeatureNoise, observe
    >>> from spinewatch.simulation.rigs import large_rig
    >>> from spinewatch.simulation.spines import random_spine
    >>> rng, rig = np.random.default_rng(1), large_rig()
    >>> images = observe(rig, random_spine(rng, 1), rng, FeatureNoise(0.1), hidden=[(1, "right")])
    >>> points = match_features(images.left, images.right, rig, 8.0, MatchingParameters())
    >>> rays = images.left.rays(rig.left), images.right.rays(rig.right)
    >>> features = FreeFeatures(points, rays, (np.arange(3), np.arange(2)))
    >>> steps = IdentificationParameters(), SelectionParameters(), OcclusionParameters()
    >>> found = occluded_candidates(features, rig, [FLAT_10_14_18], *steps, missing=1)
    >>> (found.left[0] == HIDDEN).tolist(), (found.right[0] == HIDDEN).tolist()
    ([False, False, False, True], [False, True, False, True])
    """
    problem = _Problem(features, rig, identification, selection, parameters)
    expected = missing if missing is not None else parameters.assumed_missing
    parts = [TriadCandidates.empty()]
    for index, model in enumerate(models):
        if len(model.balls) == MAX_BALLS:
            parts += _without_one_ball(problem, index, model, parameters.occluded_rate * expected)
            continue
        pairs = ball_pairs(
            features.points,
            model,
            parameters.tolerance_mm,
            identification.model_sd_mm,
            parameters.significance,
        )
        fitted = [_fit(problem, index, model, triads) for triads in _initial_triads(problem, model, pairs)]
        occluded = TriadCandidates.concatenate([TriadCandidates.empty(), *fitted])
        parts.append(_most_likely(occluded, parameters.occluded_rate * expected, parameters.max_candidates))
        if missing is not None:
            alone = pair_candidates(pairs, features.points, index, model, selection, parameters.significance)
            parts.append(_most_likely(alone, parameters.pair_rate * expected, parameters.max_pairs))
    return TriadCandidates.concatenate(parts)


def _most_likely(candidates: TriadCandidates, expected: float, max_count: int) -> TriadCandidates:
    """Return the most likely candidate for each set of features, with prior odds added, the most likely first."""
    order = np.argsort(-candidates.log_odds, kind="stable")
    left, right = (_set_numbers(features[order]) for features in (candidates.left, candidates.right))
    _, first = np.unique(left * len(order) + right, return_index=True)
    found = candidates.take(order[np.sort(first)])
    prior = np.log(expected / max(len(found), 1))
    best = np.arange(min(max_count, len(found)))
    return replace(found, log_odds=found.log_odds + prior).take(best)


def _set_numbers(features: Int) -> Int:
    """Return a number (c,) for each set of features (c, 4) of an image, the same for the same ones."""
    number = np.zeros(len(features), dtype=np.intp)
    for column in features.T:
        _, number = np.unique(number * (features.max(initial=0) + 2) + column + 1, return_inverse=True)
    return number


def _without_one_ball(
    problem: _Problem, index: int, model: TriadModel, expected: float
) -> list[TriadCandidates]:
    """Return markers of four balls of which both images show three, for each hidden ball."""
    points, parts = problem.points, []
    for hidden in range(MAX_BALLS):
        triad = model.without(hidden)
        if triad is None:
            continue
        triplets = identify_triads(points, triad, problem.identification)
        prior = float(np.log(expected / max(MAX_BALLS * len(triplets), 1)))
        found = rate_triplets(triplets, points, index, triad, problem.rig, problem.selection, prior)
        left, right = (
            np.insert(features[:, :3], hidden, HIDDEN, axis=1) for features in (found.left, found.right)
        )
        parts.append(replace(found, left=left, right=right))
    return parts


def _initial_triads(
    problem: _Problem, model: TriadModel, pairs: Sequence[BallPairs]
) -> Iterator[_InitialTriads]:
    """Yield triads for each hidden ball, each image that still shows it, and each of two positions of it."""
    for found in pairs:
        P, Q = (problem.points.position_mm[found.point[:, k]] for k in (0, 1))
        circles = third_ball_circles(P, Q, model, found.balls, problem.occlusion.n_circle_points)
        for side in (0, 1):
            yield from _initial_triads_in_image(problem, found, circles, side)


def _initial_triads_in_image(
    problem: _Problem, pairs: BallPairs, circles: Circles, side: int
) -> Iterator[_InitialTriads]:
    """Yield two triads for each feature of one image that is near a circle: third ball in front and at the back."""
    points, rays, p = problem.points, problem.features.rays[side], problem.occlusion
    near = features_near_circles(circles, rays, problem.features.free[side], p.max_circle_distance_mrad)
    score_odds = score_log_odds(points.score, problem.selection)
    a, b = pairs.balls
    third = 3 - a - b
    seen = pairs.take(near.circle)
    i, j = seen.point.T
    features = [seen.features(used, 3) for used in (points.left_index, points.right_index)]
    features[side][:, third] = near.feature
    ends = circles.along_sight(near.circle, near.point, rays.vectors[near.feature], p.min_circle_depth)
    for end in ends:
        balls_mm = np.empty((len(i), 3, 3))
        balls_mm[:, a], balls_mm[:, b], balls_mm[:, third] = points.position_mm[i], points.position_mm[j], end
        yield _InitialTriads(
            balls_mm, features[0], features[1], score_odds[i] + score_odds[j], near.distance_mm
        )


def _fit(problem: _Problem, index: int, model: TriadModel, triads: _InitialTriads) -> TriadCandidates:
    """Return the triads that fit their five ball images and face the cameras, with their log-odds."""
    p = problem.occlusion
    kept, origin, rotation = _nearest_facing(problem, model, triads)
    left, right = triads.left[kept], triads.right[kept]
    images = [triad_images(r, i) for r, i in zip(problem.features.rays, (left, right), strict=True)]
    fit = adjust_poses(model.coordinates_mm, images, origin, rotation, p.adjustment)
    still_facing, tilt_odds = tilt_log_odds(fit.position_mm, fit.rotation, problem.rig, problem.selection)
    fits = fit.determined & (fit.chi2 <= chi2_limit(_DOF, p.significance))
    fit_odds = -0.5 * fit.chi2 - 0.5 * _DOF * np.log(2 * np.pi) + log_gate_volume(_DOF, p.significance)
    candidates = TriadCandidates(
        np.full(len(kept), index, dtype=np.intp),
        fit.position_mm,
        fit.rotation,
        fit_odds + tilt_odds + triads.log_odds[kept],
        pad_features(left),
        pad_features(right),
    )
    return candidates.take(still_facing & fits)


def _nearest_facing(problem: _Problem, model: TriadModel, triads: _InitialTriads) -> tuple[Int, Float, Float]:
    """Return the indices (k,) of triads that face the cameras, the nearest to their circles, and their poses."""
    count = problem.occlusion.max_candidates
    order = np.argsort(triads.circle_distance_mm, kind="stable")
    parts = [(order[:0], np.empty((0, 3)), np.empty((0, 3, 3)))]
    for start in range(0, len(order), 2 * count):
        part = order[start : start + 2 * count]
        origin, rotation = approximate_poses(model.coordinates_mm, triads.balls_mm[part])
        facing, _ = tilt_log_odds(origin, rotation, problem.rig, problem.selection)
        parts.append((part[facing], origin[facing], rotation[facing]))
        if sum(len(found) for found, _, _ in parts) >= count:
            break
    index, origin, rotation = (np.concatenate(values)[:count] for values in zip(*parts, strict=True))
    return index, origin, rotation
