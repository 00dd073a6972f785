"""Where the images of missing balls may be: what the second look of the detector examines.

The first look proposes places by their resemblance to a ball. Once some triads are found, geometry proposes further
ones: a ball that one view shows lies on a segment of its epipolar line in the other; the third ball of a marker lies on
a circle about the other two; the ball that is missing in a triad with a pose lies where the pose says. One ball of a
doubtful triad may be a wrong one, so that each is sought about the other two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from spinewatch.arrays import Bool, Float
from spinewatch.camera import Camera, Rig
from spinewatch.detection.features import HIDDEN, Features
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.markers import TriadModel
from spinewatch.matching.triad_candidates import TriadCandidates
from spinewatch.triads.search import TriadSearch


@dataclass(frozen=True)
class SecondLookParameters:
    """Limits of the places of a second look.

    Attributes
    ----------
    rounds
        Largest number of looks while balls are missing, since a ball that is found tells where the next one may be; 0
        for none.
    features_per_triad
        Number of features per view and missing triad whose epipolar lines are examined, the most probable balls first.
    max_features
        Largest number of such features per view.
    depth_margin_mm
        How much nearer or farther than the triads found a missing one may be, mm.
    free_depth_mm
        The same about the point where the optical axes meet, when no triad was found, mm.
    max_pairs
        Number of pairs of balls, beside those of incomplete and doubtful triads, about which the third one is sought,
        the most likely first.
    max_turn_deg
        Largest rotation about the line through two balls from the orientation towards the cameras, degrees.
    step
        Distance between neighbouring places, as a fraction of the diameter of a ball.
    """

    rounds: int = 2
    features_per_triad: int = 8
    max_features: int = 24
    depth_margin_mm: float = 30.0
    free_depth_mm: float = 60.0
    max_pairs: int = 12
    max_turn_deg: float = 50.0
    step: float = 0.4


def missing_ball_places(
    search: TriadSearch,
    left: Features,
    right: Features,
    rig: Rig,
    ranges_mm: tuple[float, float],
    models: Sequence[TriadModel],
    parameters: SecondLookParameters,
    expected: int | None,
) -> tuple[Float, Float] | None:
    """Return where the images of missing balls may be.

    Parameters
    ----------
    search
        Result of the search in the features of the first look.
    left, right
        These features.
    rig
        The calibrated cameras.
    ranges_mm
        Nominal range of the markers along the left and the right optical axis, mm.
    models
        Markers in use.
    parameters
        Limits of the places.
    expected
        Number of triads placed; None if it is not known, then only the hidden balls of the triads found are missing.

    Returns
    -------
    tuple of Float or None
        Places (u, v) in the left and the right image, shape (n, 2), px; None if no ball is missing.

    Examples
    --------
    >>> from spinewatch.markers import FLAT_10_14_18
    >>> from spinewatch.simulation.observations import FeatureNoise, observe
    >>> from spinewatch.simulation.rigs import large_rig
    >>> from spinewatch.simulation.spines import random_spine
    >>> from spinewatch.triads.search import SearchParameters, match_triads
    >>> rng, rig, models = np.random.default_rng(1), large_rig(), [FLAT_10_14_18]
    >>> spine = random_spine(rng, 3)
    >>> seen = observe(rig, spine, rng, FeatureNoise(0.1), hidden=[(4, "right")])
    >>> search, p = match_triads(seen.left, seen.right, rig, SearchParameters(), expected=3), SecondLookParameters()
    >>> _, places = missing_ball_places(search, seen.left, seen.right, rig, (705.0, 705.0), models, p, 3)
    >>> ball = rig.right.project(spine[1].position_mm + spine[1].rotation @ models[0].coordinates_mm[1])
    >>> bool(np.linalg.norm(places - ball, axis=1).min() < 2)
    True
    """
    complete = _complete(search, models)
    missing = max((expected or 0) - int(complete.sum()), 0)
    if complete.all() and not missing:
        return None
    cameras = (rig.left, rig.right)
    size_mm = max(model.ball_diameter_mm for model in models)
    pairs = _likeliest_pairs(search.occluded, parameters.max_pairs)
    incomplete = search.selected.take(np.flatnonzero(~complete))
    about = TriadCandidates.concatenate([pairs, incomplete])
    points = [_hidden_balls(search), _third_balls(about, models, size_mm, parameters)]
    found: list[list[Float]] = [[camera.project(p) for p in points if len(p)] for camera in cameras]
    count = min(missing * parameters.features_per_triad, parameters.max_features)
    used = search.selected.take(np.flatnonzero(complete))
    for side, (features, taken) in enumerate(((left, used.left), (right, used.right))):
        free = np.setdiff1d(np.arange(len(features)), taken)[:count]
        beside = _along_rays(features.take(free), side, search, rig, ranges_mm, size_mm, parameters)
        found[1 - side].append(cameras[1 - side].project(beside))
    left_places, right_places = (
        _apart(np.concatenate([np.empty((0, 2)), *places]), camera, range_mm, size_mm, parameters)
        for places, camera, range_mm in zip(found, cameras, ranges_mm, strict=True)
    )
    return left_places, right_places


def _complete(search: TriadSearch, models: Sequence[TriadModel]) -> Bool:
    """Return whether triads are certain and both images show all their balls, shape (t,)."""
    found = search.selected
    balls = np.array([len(model.balls) for model in models])[found.model]
    seen = ((found.left != HIDDEN) & (found.right != HIDDEN)).sum(axis=1)
    posed = np.array([triad.pose is not None for triad in search.triads], dtype=bool)
    return np.asarray((seen == balls) & posed)


def _hidden_balls(search: TriadSearch) -> Float:
    """Return the positions (n, 3) of the balls that are hidden in an image, of triads with a pose, mm."""
    balls = [
        ball.position_mm
        for triad in search.triads
        if triad.pose is not None
        for ball in triad.balls.values()
        if ball.hidden_in
    ]
    return np.reshape(balls, (-1, 3))


def _likeliest_pairs(candidates: TriadCandidates, count: int) -> TriadCandidates:
    """Return the likeliest of the candidates that have only two balls, which both images show."""
    in_both = ((candidates.left != HIDDEN) & (candidates.right != HIDDEN)).sum(axis=1)
    either = ((candidates.left != HIDDEN) | (candidates.right != HIDDEN)).sum(axis=1)
    pairs = np.flatnonzero((in_both == 2) & (either == 2))
    return candidates.take(pairs[np.argsort(-candidates.log_odds[pairs], kind="stable")][:count])


def _third_balls(
    triads: TriadCandidates, models: Sequence[TriadModel], size_mm: float, parameters: SecondLookParameters
) -> Float:
    """Return positions (n, 3) of the third ball about each two balls of triads that both images show, mm."""
    in_both = (triads.left != HIDDEN) & (triads.right != HIDDEN)
    positions = [np.empty((0, 3))]
    for k in range(len(triads)):
        model = models[triads.model[k]].coordinates_mm
        if len(model) != 3:
            continue
        balls = triads.origin_mm[k] + model @ triads.rotation[k].T
        for a, b in combinations(np.flatnonzero(in_both[k]).tolist(), 2):
            positions.append(_turned(balls, a, b, size_mm, parameters))
    return np.concatenate(positions)


def _turned(balls_mm: Float, a: int, b: int, size_mm: float, parameters: SecondLookParameters) -> Float:
    """Return positions (n, 3) of the third of three balls (3, 3), turned about the line through two of them, mm."""
    axis = (balls_mm[b] - balls_mm[a]) / np.linalg.norm(balls_mm[b] - balls_mm[a])
    arm = balls_mm[3 - a - b] - balls_mm[a]
    radius = float(np.linalg.norm(np.cross(axis, arm)))
    turn = np.radians(parameters.max_turn_deg)
    count = 2 * int(np.ceil(turn * radius / (parameters.step * size_mm))) + 1
    turns = rotation_from_vector(np.linspace(-turn, turn, count)[:, None] * axis)
    return np.asarray(balls_mm[a] + turns @ arm)


def _along_rays(
    features: Features,
    side: int,
    search: TriadSearch,
    rig: Rig,
    ranges_mm: tuple[float, float],
    size_mm: float,
    parameters: SecondLookParameters,
) -> Float:
    """Return points (n, 3) on the rays of features of one view, at the depths where triads may be, mm."""
    camera = (rig.left, rig.right)[side]
    other = (rig.right, rig.left)[side]
    rays = features.rays(camera)
    towards = -(rig.left.M[2] + rig.right.M[2])
    towards /= np.linalg.norm(towards)
    near, far = _depths(search, rig, ranges_mm, towards, parameters)
    speed = rays.vectors @ towards
    start, end = ((depth - camera.centre @ towards) / speed for depth in (near, far))
    base = np.linalg.norm(other.centre - camera.centre)
    parallax = (far - near) * base / max(abs((near + far) / 2 - camera.centre @ towards), size_mm)
    count = max(int(np.ceil(parallax / (parameters.step * size_mm))), 1) + 1
    t = np.linspace(start, end, count)
    return np.asarray((camera.centre + t[..., None] * rays.vectors).reshape(-1, 3))


def _depths(
    search: TriadSearch,
    rig: Rig,
    ranges_mm: tuple[float, float],
    towards: Float,
    parameters: SecondLookParameters,
) -> tuple[float, float]:
    """Return the least and the greatest coordinate along a direction (3,) where triads may be, mm."""
    posed = [triad.position_mm for triad in search.triads if triad.pose is not None]
    margin = parameters.depth_margin_mm
    if not posed:
        posed = [
            camera.centre - range_mm * camera.M[2]
            for camera, range_mm in zip((rig.left, rig.right), ranges_mm, strict=True)
        ]
        margin = parameters.free_depth_mm
    depth = np.array(posed) @ towards
    return float(depth.min() - margin), float(depth.max() + margin)


def _apart(
    places: Float, camera: Camera, range_mm: float, size_mm: float, parameters: SecondLookParameters
) -> Float:
    """Return the places (n, 2) within the image, one of those that are within half a step of each other."""
    size = np.array(camera.image_size_px)
    inside = places[np.all((places >= 0) & (places <= size - 1), axis=1)]
    cell = np.array(camera.ball_diameter_px(size_mm, range_mm)) * parameters.step / 2
    _, first = np.unique(np.floor(inside / cell).astype(np.intp), axis=0, return_index=True)
    return inside[np.sort(first)]
