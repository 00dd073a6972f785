"""Triads that are not in full view: found from the balls that both views show and what one view shows of others.

Two balls leave a triad free to turn about the line between them. The image of the third in one view stops
that turn: the circle on which it may lie passes there once or twice. Ten image coordinates for six unknowns
leave four to test the fit by, where a triad in full view has six; so the row along the spine has more to say
about these. Two balls alone have no pose, and are reported only where the row leaves no doubt. A marker of
four balls that lacks one is a triad.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from spinewatch.arrays import Float, Int
from spinewatch.camera import Rig
from spinewatch.geometry.rays import Rays
from spinewatch.geometry.transforms import approximate_poses
from spinewatch.markers import TriadModel
from spinewatch.matching.identification import (
    IdentificationParameters,
    identify_triads,
    log_gate_volume,
    within_reach,
)
from spinewatch.matching.points import Points
from spinewatch.matching.selection import (
    HIDDEN,
    SelectionParameters,
    TriadCandidates,
    padded,
    point_odds,
    score_odds,
    weigh_tilt,
    weigh_triplets,
)
from spinewatch.triads.pose_adjustment import adjust_poses
from spinewatch.triads.pose_fit import triad_view

_FREEDOM = 4
_TURNS = 24
_MOST_PAIRS = 60
_MAKING_SD_MM = 0.2
_LEAST_DEPTH = 0.2  # of the radius


@dataclass(frozen=True)
class OcclusionParameters:
    """Limits of the search for triads with a hidden ball.

    ``tolerance_mm`` of the distance of the two balls in full view; ``reach_mrad`` between the third ball's
    image and the circle on which it may lie, as 24 points show it; ``loss``, the share of true ones that the
    fit's chi-square discards; ``share``, how often a triad that is not in full view lacks just one ball
    image, and how many are expected when the number of triads is unknown; ``pair_share``, the same for two
    balls in full view and no more; ``extra_sd_mrad`` as in ``MatcherParameters``, but smaller, since large
    errors would hide which of two poses is the true one; ``max_candidates`` fitted. ``enabled`` false finds
    triads in full view only.
    """

    enabled: bool = True
    tolerance_mm: float = 3.0
    reach_mrad: float = 4.0
    loss: float = 0.001
    share: float = 0.3
    pair_share: float = 0.1
    extra_sd_mrad: float = 0.1
    max_candidates: int = 200


@dataclass(frozen=True, eq=False)
class _Seeds:
    """Possible triads: balls (c, 3, 3), mm, left and right features (c, 3), log-odds (c,), image misfit (c,), mm."""

    balls_mm: Float
    left: Int
    right: Int
    odds: Float
    misfit_mm: Float


def occluded_candidates(
    points: Points,
    rays: tuple[Rays, Rays],
    free: tuple[Int, Int],
    rig: Rig,
    models: Sequence[TriadModel],
    choose: SelectionParameters,
    parameters: OcclusionParameters,
    missing: int | None,
) -> TriadCandidates:
    """Return triads with a hidden ball, strongest first of each kind.

    ``rays`` (left, right) of all features; ``points`` and ``free`` features that may still be used;
    ``missing`` triads are expected, or None. Of two poses of the same features the likelier is listed.
    """
    expected = missing if missing is not None else 1
    parts = [TriadCandidates.empty()]
    for index, model in enumerate(models):
        if len(model.balls) == 4:
            parts += _without_one_ball(points, rig, index, model, choose, parameters.share * expected)
            continue
        seeds = _seeds(points, rays, free, model, choose, parameters)
        fitted = TriadCandidates.joined(
            [TriadCandidates.empty()] + [_fit(s, rays, rig, index, model, choose, parameters) for s in seeds]
        )
        parts.append(_strongest(fitted, parameters.share * expected, parameters.max_candidates))
        if missing is not None:
            pairs = _bare_pairs(points, index, model, choose, parameters)
            parts.append(_strongest(pairs, parameters.pair_share * expected, _MOST_PAIRS))
    return TriadCandidates.joined(parts)


def _strongest(found: TriadCandidates, expected: float, most: int) -> TriadCandidates:
    """Return the likeliest candidate for each set of features, strongest first, with their odds beforehand."""
    order = np.argsort(-found.log_odds, kind="stable")
    features = np.concatenate([found.left, found.right], axis=1)[order]
    _, first = np.unique(features, axis=0, return_index=True)
    found = found.take(order[np.sort(first)])
    prior = np.log(expected / max(len(found), 1))
    return replace(found, log_odds=found.log_odds + prior).take(np.arange(min(most, len(found))))


def _without_one_ball(
    points: Points, rig: Rig, index: int, model: TriadModel, choose: SelectionParameters, expected: float
) -> list[TriadCandidates]:
    """Return markers of four balls of which just three are in full view, for each hidden ball."""
    parts = []
    for hidden in range(4):
        triad = model.without(hidden)
        if triad is None:
            continue
        triplets = identify_triads(points, triad, IdentificationParameters())
        prior = float(np.log(expected / max(4 * len(triplets), 1)))
        found = weigh_triplets(triplets, points, index, triad, rig, choose, prior)
        left, right = (
            np.insert(features[:, :3], hidden, HIDDEN, axis=1) for features in (found.left, found.right)
        )
        parts.append(replace(found, left=left, right=right))
    return parts


def _bare_pairs(
    points: Points,
    index: int,
    model: TriadModel,
    choose: SelectionParameters,
    parameters: OcclusionParameters,
) -> TriadCandidates:
    """Return pairs of balls of a triad of which a view may show the third, with a pose that faces up."""
    lists = within_reach(points, model.distances_mm, parameters.tolerance_mm)
    odds = point_odds(points, choose)
    parts = [TriadCandidates.empty()]
    for (a, b), distance, pairs in zip(model.pairs.tolist(), model.distances_mm, lists, strict=True):
        p, q = pairs.T
        along = points.position_mm[q] - points.position_mm[p]
        u = along / np.linalg.norm(along, axis=1, keepdims=True)
        surprise = _surprise(points, pairs, distance)
        fitting = -0.5 * surprise - 0.5 * np.log(2 * np.pi) + log_gate_volume(1, parameters.loss)
        A, B = model.coordinates_mm[a], model.coordinates_mm[b]
        rotation = _frames_up(u) @ _frames_up(((B - A) / distance)[None])[0].T
        origin = (points.position_mm[p] + points.position_mm[q]) / 2 - rotation @ ((A + B) / 2)
        images = np.full((2, len(pairs), 4), HIDDEN)
        for row, used in zip(images, (points.left_index, points.right_index), strict=True):
            row[:, a], row[:, b] = used[p], used[q]
        kinds = np.full(len(pairs), index, dtype=np.intp)
        found = TriadCandidates(kinds, origin, rotation, fitting + odds[p] + odds[q], images[0], images[1])
        parts.append(found.take(surprise <= chi2.isf(parameters.loss, 1)))
    return TriadCandidates.joined(parts)


def _surprise(points: Points, pairs: Int, distance_mm: float) -> Float:
    """Return the chi-squares (p,) of the distances of pairs of points, one degree of freedom."""
    p, q = pairs.T
    along = points.position_mm[q] - points.position_mm[p]
    length = np.linalg.norm(along, axis=1)
    u = along / length[:, None]
    S = points.covariance_mm2[p] + points.covariance_mm2[q]
    variance = np.einsum("ni,nij,nj->n", u, S, u) + _MAKING_SD_MM**2
    return np.asarray((length - distance_mm) ** 2 / variance)


def _frames_up(u: Float) -> Float:
    """Return frames (n, 3, 3) whose x is a unit vector (n, 3) and whose z is as near as can be to Z."""
    z = np.array([0.0, 0.0, 1.0]) - u[:, 2:] * u
    z /= np.maximum(np.linalg.norm(z, axis=1, keepdims=True), 1e-9)
    return np.stack([u, np.cross(z, u), z], axis=-1)


def _seeds(
    points: Points,
    rays: tuple[Rays, Rays],
    free: tuple[Int, Int],
    model: TriadModel,
    choose: SelectionParameters,
    parameters: OcclusionParameters,
) -> Iterator[_Seeds]:
    """Yield possible triads for each hidden ball and each view that still shows it."""
    lists = within_reach(points, model.distances_mm, parameters.tolerance_mm)
    odds = score_odds(points.score, choose)
    own = points.left_index, points.right_index
    for (a, b), distance, every in zip(model.pairs.tolist(), model.distances_mm, lists, strict=True):
        hidden = 3 - a - b
        pairs = every[_surprise(points, every, distance) <= chi2.isf(parameters.loss, 1)]
        circles = _third_balls(points, pairs, model, (a, b))
        for side in (0, 1):
            pair, feature, turn, misfit = _meetings(circles.points(), rays[side], free[side], parameters)
            p, q = pairs[pair].T
            images = np.full((2, len(pair), 3), HIDDEN)
            for row, used in zip(images, own, strict=True):
                row[:, a], row[:, b] = used[p], used[q]
            images[side, :, hidden] = feature
            balls = np.empty((len(pair), 3, 3))
            balls[:, a], balls[:, b] = points.position_mm[p], points.position_mm[q]
            for third in circles.along_sight(pair, turn, rays[side].vectors[feature]):
                balls[:, hidden] = third
                yield _Seeds(balls.copy(), images[0], images[1], odds[p] + odds[q], misfit)


@dataclass(frozen=True, eq=False)
class _Circles:
    """Circles of one radius: centres (c, 3), unit axes (c, 3) and where they start (c, 3), a unit vector across."""

    centre: Float
    axis: Float
    start: Float
    radius_mm: float

    def points(self) -> Float:
        """Return the points (c, turns, 3) of the circles, evenly spaced."""
        turn = np.linspace(0, 2 * np.pi, _TURNS, endpoint=False)[:, None]
        aside = np.cross(self.axis, self.start)
        around = np.cos(turn) * self.start[:, None] + np.sin(turn) * aside[:, None]
        return np.asarray(self.centre[:, None] + self.radius_mm * around)

    def along_sight(self, index: Int, turn: Int, sight: Float) -> tuple[Float, Float]:
        """Return the two points (k, 3) each of circles that a line of sight passes, front and back.

        Where it only touches, they lie a little apart, on both sides of the touching point.
        """
        at = self.points()[index, turn] - self.centre[index]
        axis = self.axis[index]
        line = sight - (sight * axis).sum(axis=1, keepdims=True) * axis
        line /= np.maximum(np.linalg.norm(line, axis=1, keepdims=True), 1e-9)
        deep = (at * line).sum(axis=1, keepdims=True)
        beside = at - deep * line
        deep = np.maximum(np.abs(deep), _LEAST_DEPTH * self.radius_mm)
        ends = []
        for sign in (-1, 1):
            end = beside + sign * deep * line
            end *= self.radius_mm / np.linalg.norm(end, axis=1, keepdims=True)
            ends.append(self.centre[index] + end)
        return ends[0], ends[1]


def _third_balls(points: Points, pairs: Int, model: TriadModel, known: tuple[int, int]) -> _Circles:
    """Return the circles on which the third ball may lie, about the lines of pairs (c, 2)."""
    a, b = known
    A, B, C = (model.coordinates_mm[k] for k in (a, b, 3 - a - b))
    span = float(np.linalg.norm(B - A))
    along = float((C - A) @ (B - A)) / span
    radius = float(np.sqrt(((C - A) ** 2).sum() - along**2))
    P, Q = points.position_mm[pairs[:, 0]], points.position_mm[pairs[:, 1]]
    u = (Q - P) / np.linalg.norm(Q - P, axis=1, keepdims=True)
    return _Circles((P + Q) / 2 + (along - span / 2) * u, u, _frames_up(u)[:, :, 2], radius)


def _meetings(
    circles: Float, rays: Rays, free: Int, parameters: OcclusionParameters
) -> tuple[Int, Int, Int, Float]:
    """Return (pair, feature, turn, misfit on the plate in mm) where circles come near free features in a view."""
    if not len(circles) or not len(free):
        none = np.empty(0, dtype=np.intp)
        return none, none, none, np.empty(0)
    images, _ = rays.pinhole.project(circles)
    margin = rays.pinhole.focal_length_mm * parameters.reach_mrad / 1000
    low, high = images.min(axis=1)[:, None] - margin, images.max(axis=1)[:, None] + margin
    at = rays.ideal_mm[free]
    pair, k = np.nonzero(np.all((at >= low) & (at <= high), axis=-1))
    miss = np.linalg.norm(images[pair] - at[k][:, None], axis=-1)
    turn = miss.argmin(axis=1)
    misfit = miss[np.arange(len(miss)), turn]
    near = np.flatnonzero(misfit <= margin)
    return pair[near], free[k[near]], turn[near], misfit[near]


def _fit(
    seeds: _Seeds,
    rays: tuple[Rays, Rays],
    rig: Rig,
    index: int,
    model: TriadModel,
    choose: SelectionParameters,
    parameters: OcclusionParameters,
) -> TriadCandidates:
    origin, rotation = approximate_poses(model.coordinates_mm, seeds.balls_mm)
    facing = np.flatnonzero(weigh_tilt(origin, rotation, rig, choose)[0])
    kept = facing[np.argsort(seeds.misfit_mm[facing], kind="stable")][: parameters.max_candidates]
    left, right = seeds.left[kept], seeds.right[kept]
    views = [triad_view(r, i) for r, i in zip(rays, (left, right), strict=True)]
    fit = adjust_poses(model.coordinates_mm, views, origin[kept], rotation[kept], steps=5)
    facing_now, tilt = weigh_tilt(fit.position_mm, fit.rotation, rig, choose)
    good = facing_now & fit.determined & (fit.chi2 <= chi2.isf(parameters.loss, _FREEDOM))
    fitting = (
        -0.5 * fit.chi2 - 0.5 * _FREEDOM * np.log(2 * np.pi) + log_gate_volume(_FREEDOM, parameters.loss)
    )
    log_odds = fitting + tilt + seeds.odds[kept]
    found = TriadCandidates(
        np.full(len(kept), index, dtype=np.intp),
        fit.position_mm,
        fit.rotation,
        log_odds,
        padded(left),
        padded(right),
    )
    return found.take(good)
