"""Why a pair of images has these triads: every candidate triad, and what rejected those not chosen."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Bool, Float, Int
from spinewatch.camera import Rig
from spinewatch.detection.features import HIDDEN, Features
from spinewatch.geometry.transforms import approximate_poses
from spinewatch.markers import TriadModel
from spinewatch.matching.exclusion import RemovedTriad, removed_candidates
from spinewatch.matching.identification import discarded_tuples
from spinewatch.matching.insertion import insertion_gains
from spinewatch.matching.points import Points
from spinewatch.matching.rating import rate_triplets, tilt_log_odds
from spinewatch.matching.rejections import FeatureRejection, TriadRejection
from spinewatch.matching.selection_parameters import SpineAxis
from spinewatch.matching.triad_candidates import TriadCandidates
from spinewatch.triads.pose import MeasuredTriad
from spinewatch.triads.search import SearchParameters, TriadSearch


@dataclass(frozen=True, eq=False)
class TriadVerdict:
    """A candidate triad, and why it was rejected.

    Attributes
    ----------
    model
        The marker.
    left, right
        Indices of the features of its n balls, shape (n,); `HIDDEN` where a ball is hidden.
    position_mm
        Approximate position, shape (3,), object space, mm.
    error_mm
        Error of the distance matrix (eq. 5.17) of the balls that both images show, mm.
    log_odds
        Log-odds on its own; None when it was rejected before they were computed.
    reason
        Why it was rejected; None when it was chosen.
    rival
        Index of the chosen triad that excludes it; None for others.
    """

    model: TriadModel
    left: Int
    right: Int
    position_mm: Float
    error_mm: float
    log_odds: float | None
    reason: TriadRejection | None
    rival: int | None = None


@dataclass(frozen=True)
class FeatureUse:
    """What became of a feature.

    Attributes
    ----------
    triad
        Index of the chosen triad that it belongs to, or None.
    ball
        Name of its ball there, or None.
    reason
        Why it belongs to none, or None.
    """

    triad: int | None
    ball: str | None
    reason: FeatureRejection | None


@dataclass(frozen=True, eq=False)
class Explanation:
    """What was considered in a pair of images.

    Attributes
    ----------
    points
        Triangulated points, the most likely first.
    verdicts
        Candidate triads: the chosen ones along the spine, then the rejected ones, the most likely first.
    uses
        What became of the features of the left and of the right image.
    triads
        The measured triads of the chosen candidates, in their order.
    method
        Method that measured.
    """

    points: Points
    verdicts: tuple[TriadVerdict, ...]
    uses: tuple[tuple[FeatureUse, ...], tuple[FeatureUse, ...]]
    triads: tuple[MeasuredTriad, ...]
    method: str = "default"


def explain(
    search: TriadSearch,
    features: tuple[Features, Features],
    rig: Rig,
    parameters: SearchParameters,
    models: Sequence[TriadModel],
    *,
    expected: int | None = None,
    axis: SpineAxis = "auto",
    removed: Sequence[RemovedTriad] = (),
) -> Explanation:
    """Return what a search considered, and what rejected the candidates that it did not choose.

    Parameters
    ----------
    search
        Result of `match_triads` for the further arguments.
    features
        Features of the left and the right image.
    rig
        The calibrated cameras.
    parameters
        Parameters of the search.
    models
        Markers in use.
    expected
        Number of triads placed; None if it is not known.
    axis
        Object axis along which the spine extends.
    removed
        Triads that a person removed.

    Returns
    -------
    Explanation
        Points, candidate triads and the use of the features.

    References
    ----------
    Thesis section 5.6 and Tables 5.4 to 5.6, which print the heuristic that discards each triplet.

    Examples
    --------
    >>> from spinewatch.markers import FLAT_10_14_18
    >>> from spinewatch.simulation.observations import FeatureNoise, observe
    >>> from spinewatch.simulation.rigs import large_rig
    >>> from spinewatch.simulation.spines import random_spine
    >>> from spinewatch.triads.search import match_triads
    >>> rng, rig = np.random.default_rng(1), large_rig()
    >>> seen = observe(rig, random_spine(rng, 4), rng, FeatureNoise(0.1, false_features=20))
    >>> search = match_triads(seen.left, seen.right, rig, SearchParameters(), expected=4)
    >>> found = explain(search, (seen.left, seen.right), rig, SearchParameters(), [FLAT_10_14_18], expected=4)
    >>> [verdict.reason for verdict in found.verdicts[:4]]
    [None, None, None, None]
    """
    considered, rejected = _rated(search, rig, parameters, models, expected)
    gone = removed_candidates(considered.candidates, *features, removed)
    rejected += considered.verdicts(models, np.flatnonzero(gone), TriadRejection.REMOVED)
    pool = considered.take(np.flatnonzero(~gone)).joined(_occluded(search, models))
    chosen, others = _judged(pool, search, parameters, models, expected, axis)
    rejected += others
    for model in models:
        rejected += _outside_limits(search.points, model, parameters)
    rejected.sort(key=_by_likelihood)
    verdicts = (*chosen, *rejected)
    order = np.argsort(-search.points.log_odds, kind="stable")
    uses = feature_uses(features, search.points, verdicts)
    return Explanation(search.points.take(order), verdicts, uses, search.triads)


def feature_uses(
    features: tuple[Features, Features], points: Points, verdicts: Sequence[TriadVerdict]
) -> tuple[tuple[FeatureUse, ...], tuple[FeatureUse, ...]]:
    """Return what became of the features of both images.

    Parameters
    ----------
    features
        Features of the left and the right image.
    points
        Triangulated points.
    verdicts
        Candidate triads, the chosen ones first.

    Returns
    -------
    tuple
        Use of each feature of the left and of the right image.
    """
    left, right = (_uses(len(one), side, points, verdicts) for side, one in enumerate(features))
    return left, right


@dataclass(frozen=True, eq=False)
class _Pool:
    """Candidates (c,) with the errors (c,) of their distances, mm."""

    candidates: TriadCandidates
    error_mm: Float

    def take(self, index: Int) -> _Pool:
        return _Pool(self.candidates.take(index), self.error_mm[index])

    def joined(self, other: _Pool) -> _Pool:
        candidates = TriadCandidates.concatenate([self.candidates, other.candidates])
        return _Pool(candidates, np.concatenate([self.error_mm, other.error_mm]))

    def verdict(
        self, models: Sequence[TriadModel], c: int, reason: TriadRejection | None, rival: int | None = None
    ) -> TriadVerdict:
        """Return the verdict on a candidate."""
        found, model = self.candidates, models[self.candidates.model[c]]
        n = len(model.balls)
        return TriadVerdict(
            model,
            found.left[c, :n],
            found.right[c, :n],
            found.origin_mm[c],
            float(self.error_mm[c]),
            float(found.log_odds[c]),
            reason,
            rival,
        )

    def verdicts(
        self, models: Sequence[TriadModel], index: Iterable[int], reason: TriadRejection
    ) -> list[TriadVerdict]:
        """Return the same verdict on several candidates."""
        return [self.verdict(models, c, reason) for c in index]


def _rated(
    search: TriadSearch,
    rig: Rig,
    parameters: SearchParameters,
    models: Sequence[TriadModel],
    expected: int | None,
) -> tuple[_Pool, list[TriadVerdict]]:
    """Return the candidates in full view that the selection considered, and verdicts on those that it did not."""
    p, points = parameters.selection, search.points
    total = sum(map(len, search.triplets))
    prior = float(np.log((expected or p.assumed_count) / max(total, 1)))
    pools, rejected = [_Pool(TriadCandidates.empty(), np.empty(0))], []
    for index, (triplets, model) in enumerate(zip(search.triplets, models, strict=True)):
        origin, rotation = approximate_poses(model.coordinates_mm, points.position_mm[triplets.point])
        facing, _ = tilt_log_odds(origin, rotation, rig, p)
        away = np.flatnonzero(~facing)
        tilted = [TriadRejection.TILT] * len(away)
        rejected += _early(points, model, triplets.point[away], origin[away], triplets.error_mm[away], tilted)
        rated = rate_triplets(triplets, points, index, model, rig, p, prior)
        pools.append(_Pool(rated, triplets.error_mm[facing]))
    pool = pools[0]
    for further in pools[1:]:
        pool = pool.joined(further)
    pool = pool.take(np.argsort(-pool.candidates.log_odds, kind="stable"))
    rest = range(p.max_candidates, len(pool.candidates))
    rejected += pool.verdicts(models, rest, TriadRejection.NOT_CONSIDERED)
    return pool.take(np.arange(min(p.max_candidates, len(pool.candidates)))), rejected


def _occluded(search: TriadSearch, models: Sequence[TriadModel]) -> _Pool:
    """Return the candidates with a hidden ball that were considered."""
    points, found = search.points, search.occluded
    pairs = zip(points.left_index.tolist(), points.right_index.tolist(), strict=True)
    number = {pair: k for k, pair in enumerate(pairs)}
    errors = []
    for c in range(len(found)):
        model = models[found.model[c]]
        balls = [
            number.get(pair) for pair in zip(found.left[c].tolist(), found.right[c].tolist(), strict=True)
        ]
        known = [
            (points.position_mm[balls[a]], points.position_mm[balls[b]], distance)
            for (a, b), distance in zip(model.pairs.tolist(), model.distances_mm, strict=True)
            if balls[a] is not None and balls[b] is not None
        ]
        errors.append(float(np.linalg.norm([np.linalg.norm(a - b) - d for a, b, d in known])))
    return _Pool(found, np.array(errors))


def _judged(
    pool: _Pool,
    search: TriadSearch,
    parameters: SearchParameters,
    models: Sequence[TriadModel],
    expected: int | None,
    axis: SpineAxis,
) -> tuple[list[TriadVerdict], list[TriadVerdict]]:
    """Return the chosen candidates in the order of the search, and verdicts on the others."""
    p, candidates, selected = parameters.selection, pool.candidates, search.selected
    same = (candidates.model[:, None] == selected.model) & np.all(
        (candidates.left[:, None] == selected.left) & (candidates.right[:, None] == selected.right), axis=-1
    )
    chosen = [pool.verdict(models, int(np.flatnonzero(same[:, k])[0]), None) for k in range(len(selected))]
    rest = pool.take(np.flatnonzero(~same.any(axis=1)))
    point, feature = _shared(rest.candidates, selected)
    gaps = np.linalg.norm(rest.candidates.origin_mm[:, None] - selected.origin_mm, axis=-1)
    others, free = [], []
    for c in range(len(rest.candidates)):
        for reason, excluded in (
            (TriadRejection.POINT_TAKEN, point[c]),
            (TriadRejection.FEATURE_TAKEN, feature[c]),
            (TriadRejection.TOO_NEAR, gaps[c] < p.chain.min_gap_mm),
        ):
            if excluded.any():
                others.append(rest.verdict(models, c, reason, int(np.flatnonzero(excluded)[0])))
                break
        else:
            free.append(c)
    beside = rest.take(np.array(free, dtype=np.intp))
    gains = insertion_gains(selected, beside.candidates, search.points, p, axis)
    full = len(selected) >= (p.max_count if expected is None else expected)
    for c, gain in enumerate(gains):
        improbable = beside.candidates.log_odds[c] < p.chain.min_log_odds
        if gain > 0 and full:
            reason = TriadRejection.COUNT
        elif improbable or gain > 0:
            reason = TriadRejection.IMPROBABLE
        else:
            reason = TriadRejection.SPACING
        others.append(beside.verdict(models, c, reason))
    return chosen, others


def _shared(candidates: TriadCandidates, selected: TriadCandidates) -> tuple[Bool, Bool]:
    """Return whether candidates (c,) share a point with selected ones (k,), and whether a feature; shape (c, k)."""
    left = (candidates.left[:, None, :, None] == selected.left[None, :, None, :]) & (
        candidates.left != HIDDEN
    )[:, None, :, None]
    right = (candidates.right[:, None, :, None] == selected.right[None, :, None, :]) & (
        candidates.right != HIDDEN
    )[:, None, :, None]
    return (left & right).any(axis=(2, 3)), (left | right).any(axis=(2, 3))


def _outside_limits(points: Points, model: TriadModel, parameters: SearchParameters) -> list[TriadVerdict]:
    """Return verdicts on the tuples near the distances of a marker that the identification discards."""
    found = discarded_tuples(points, model, parameters.identification)
    origin, _ = approximate_poses(model.coordinates_mm, points.position_mm[found.point])
    reasons = [
        TriadRejection.FEATURE_TWICE
        if not distinct
        else TriadRejection.MIRRORED
        if not same_handed
        else TriadRejection.DISTANCES
        for distinct, same_handed in zip(found.distinct.tolist(), found.same_handed.tolist(), strict=True)
    ]
    return _early(points, model, found.point, origin, found.error_mm, reasons)


def _early(
    points: Points,
    model: TriadModel,
    point: Int,
    origin_mm: Float,
    error_mm: Float,
    reasons: Sequence[TriadRejection],
) -> list[TriadVerdict]:
    """Return the verdicts on tuples (t, n) of points that were rejected before their log-odds were computed."""
    left, right = points.left_index[point], points.right_index[point]
    return [
        TriadVerdict(model, left[t], right[t], origin_mm[t], error, None, reason)
        for t, (error, reason) in enumerate(zip(error_mm.tolist(), reasons, strict=True))
    ]


def _by_likelihood(verdict: TriadVerdict) -> tuple[bool, float]:
    return verdict.log_odds is None, verdict.error_mm if verdict.log_odds is None else -verdict.log_odds


def _uses(
    count: int,
    side: int,
    points: Points,
    verdicts: Sequence[TriadVerdict],
) -> tuple[FeatureUse, ...]:
    """Return what became of the features of an image."""
    balls = {
        feature: FeatureUse(k, name, None)
        for k, verdict in enumerate(verdicts)
        if verdict.reason is None
        for feature, name in zip(
            (verdict.left, verdict.right)[side].tolist(), verdict.model.balls, strict=True
        )
        if feature != HIDDEN
    }
    columns = [(verdict.left, verdict.right)[side] for verdict in verdicts]
    tried = set(np.concatenate(columns).tolist()) if columns else set()
    matched = set((points.left_index, points.right_index)[side].tolist())
    rejected, no_triad, no_partner = (
        FeatureUse(None, None, reason)
        for reason in (FeatureRejection.REJECTED, FeatureRejection.NO_TRIAD, FeatureRejection.NO_PARTNER)
    )
    return tuple(
        balls.get(feature)
        or (rejected if feature in tried else no_triad if feature in matched else no_partner)
        for feature in range(count)
    )
