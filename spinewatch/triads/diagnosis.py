"""Why a stereo pair shows no triads: the change to images or rig with which its features become triads.

Each likely mistake is undone in turn: images exchanged, mirrored or turned, a camera rotated across the epipolar lines,
a base or range that is far off. The search for triads in full view is repeated, and its chain has log-odds. A cause is
named only if these are far above chance and far above those of every other cause. Whether images without triads belong
together at all follows from the number of features that are on each other's epipolar lines, compared with the number if
the lines are displaced. That does not distinguish images of two stages from hidden markers with certainty.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from spinewatch.arrays import Bool, Float
from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.errors import SpinewatchError
from spinewatch.geometry.rays import Rays
from spinewatch.geometry.transforms import approximate_poses
from spinewatch.geometry.triangulation import triangulate
from spinewatch.markers import TriadModel, scaled
from spinewatch.matching.epipolar import EpipolarParameters, range_limits_mm, within_segment
from spinewatch.matching.identification import identify_triads
from spinewatch.matching.points import Points, match_features
from spinewatch.matching.rating import likeliest_points, rate_candidates, score_log_odds, tilt_log_odds
from spinewatch.matching.selection import chain_log_odds
from spinewatch.matching.selection_parameters import SpineAxis
from spinewatch.triads.search import SearchParameters

Pair = tuple[Features, Features]

_MOVED, _SIZE = "moved", "size"
"""Causes for which the calibration is no longer that of the rig."""

_EXCHANGED = "exchanged"
"""Images exchanged, or both turned upside down, which is the same for a symmetric rig without distortion."""


@dataclass(frozen=True)
class DiagnosisParameters:
    """When a cause is named.

    Attributes
    ----------
    max_features
        Number of features per image, the best ones, with which causes are tried.
    min_triads
        Smallest number of triads in full view under a cause.
    min_log_odds
        Smallest log-odds of their chain, less the logarithm of the number of trials.
    min_lead
        Smallest difference of the log-odds to those of every other cause and of the pair as given.
    sizes
        Sizes of the markers that are tried, relative to the known one.
    max_rotation_deg
        Largest rotation of the right camera across the epipolar lines and about its axis, degrees.
    triplet_spread_mrad, triplet_sd_mrad
        Largest spread of the epipolar distances of a triplet's balls without a rotation about the axis, and their
        standard deviation, mrad.
    offset_tolerance_mrad
        Largest difference of a triplet's epipolar distance from a common one, mrad.
    roll_log_odds
        Log-odds by which a rotation about the axis must improve the chain.
    roll_spread
        Addition to the largest spread per unit of the largest rotation about the axis.
    min_across
        Smallest distance of two triplets across the right image, as a fraction of the focal length, from which a
        rotation about the axis is determined.
    min_offset_mrad
        Smallest epipolar offset that is tried, mrad.
    offset_separation_mrad
        Smallest difference between the offsets that are tried, mrad.
    roll_separation_weight
        Weight of the rotation about the axis in that difference.
    exchange_trials, mirror_trials
        Number of trials, for their logarithm, of exchanged images and of mirrored or turned ones.
    max_offset_features
        Number of features per image for the epipolar offset.
    max_triplets
        Number of triplets considered together for the epipolar offset.
    max_offsets
        Number of offsets tried with a search.
    offset_trials
        Number of offsets that are distinguished, for the logarithm of the number of trials.
    range_fractions
        Range of features that may meet, when it is counted how many do.
    meeting_features
        Numbers of features per image with which it is counted.
    meeting_mrad
        Epipolar distance below which two features meet, mrad.
    meeting_offsets_mrad
        First, last and step of the offsets of comparison, mrad.
    related_sigma
        Standard deviations by which more features meet than at the offsets of comparison, from which on the images are
        taken to belong together.
    """

    max_features: int = 150
    min_triads: int = 2
    min_log_odds: float = 12.0
    min_lead: float = 7.0
    sizes: tuple[float, ...] = (0.91, 0.94, 0.97, 1.03, 1.06, 1.09)
    max_rotation_deg: float = 1.5
    triplet_spread_mrad: float = 1.2
    triplet_sd_mrad: float = 0.35
    offset_tolerance_mrad: float = 0.8
    roll_log_odds: float = 4.0
    roll_spread: float = 8.0
    min_across: float = 0.05
    min_offset_mrad: float = 0.5
    offset_separation_mrad: float = 1.0
    roll_separation_weight: float = 0.3
    exchange_trials: int = 4
    mirror_trials: int = 24
    max_offset_features: int = 70
    max_triplets: int = 60
    max_offsets: int = 3
    offset_trials: int = 200
    range_fractions: tuple[float, float] = (0.85, 1.12)
    meeting_features: tuple[int, ...] = (40, 150)
    meeting_mrad: float = 0.6
    meeting_offsets_mrad: tuple[float, float, float] = (3.0, 30.0, 0.65)
    related_sigma: float = 4.0


@dataclass(frozen=True)
class Diagnosis:
    """The likeliest reason why triads are missing.

    Attributes
    ----------
    cause
        Name of the cause; ``hidden`` if the images belong together, ``hidden-or-unrelated`` if that is not certain.
    detail
        The cause in words.
    triads
        Number of triads in full view with the cause undone.
    log_odds
        Log-odds of their chain, less the logarithm of the number of trials.
    """

    cause: str
    detail: str
    triads: int
    log_odds: float

    @property
    def rig_has_moved(self) -> bool:
        """Whether the cause is a rig that is not the calibrated one."""
        return self.cause in (_MOVED, _SIZE)


@dataclass(frozen=True, eq=False)
class _Trial:
    """A mistake undone: features, rig and markers with which the search is repeated."""

    cause: str
    detail: str
    pair: Pair
    rig: Rig
    models: Sequence[TriadModel]
    trials: int


@dataclass(frozen=True, eq=False)
class _Offsets:
    """Triplets of features with their epipolar distance and position across the right image, both mrad and 1."""

    distance_mrad: Float
    across: Float
    log_odds: Float
    exclusive: Bool = field(default_factory=lambda: np.empty((0, 0), dtype=bool))


def diagnose(
    left: Features,
    right: Features,
    rig: Rig,
    search: SearchParameters,
    models: Sequence[TriadModel],
    parameters: DiagnosisParameters | None = None,
    *,
    expected: int | None = None,
    axis: SpineAxis = "auto",
) -> Diagnosis:
    """Return why the features of a stereo pair show no triads.

    Parameters
    ----------
    left, right
        Features of the two images.
    rig
        The calibrated cameras.
    search
        Parameters of the search.
    models
        Markers in use.
    parameters
        When a cause is named; the default ones if None.
    expected
        Number of triads placed; None if it is not known.
    axis
        Object axis along which the spine extends.

    Returns
    -------
    Diagnosis
        The cause.

    References
    ----------
    Not in the thesis.

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.markers import FLAT_10_14_18
    >>> from spinewatch.simulation.observations import FeatureNoise, observe
    >>> from spinewatch.simulation.rigs import large_rig
    >>> from spinewatch.simulation.spines import random_spine
    >>> rng, rig = np.random.default_rng(2), large_rig()
    >>> seen = observe(rig, random_spine(rng, 4), rng, FeatureNoise(0.1, false_features=10))
    >>> diagnose(seen.right, seen.left, rig, SearchParameters(), [FLAT_10_14_18], expected=4).cause
    'exchanged'
    """
    p = parameters or DiagnosisParameters()
    if not len(left) or not len(right):
        return Diagnosis("no-features", "nothing in an image resembles a ball", 0, 0.0)
    pair = _best(left, p.max_features), _best(right, p.max_features)
    found = []
    for trial in _trials(pair, rig, search, models, p):
        triads, log_odds = _chain(trial, search, expected, axis)
        found.append(Diagnosis(trial.cause, trial.detail, triads, log_odds - float(np.log(trial.trials))))
    found.sort(key=lambda diagnosis: -diagnosis.log_odds)
    best = found[0]
    same = [
        other for other in found if other.cause == best.cause and best.log_odds - other.log_odds < p.min_lead
    ]
    others = [other.log_odds for other in found if other.cause != best.cause]
    certain = best.triads >= p.min_triads and best.log_odds >= p.min_log_odds
    if best.cause and certain and best.log_odds - max(others, default=0.0) >= p.min_lead:
        details = [other.detail for other in same] if best.cause == _EXCHANGED else [best.detail]
        return replace(best, detail=", or ".join(details))
    given = next(d for d in found if not d.cause)
    if (given.triads and given.log_odds >= p.min_log_odds) or meeting_sigma(pair, rig, p) >= p.related_sigma:
        detail = "the images seem to belong together: balls are hidden or were not detected"
        return replace(given, cause="hidden", detail=detail)
    detail = (
        "the features of the two images do not meet: balls are hidden or were not detected, or the images are not of"
        " the same moment, or not of this rig"
    )
    return replace(given, cause="hidden-or-unrelated", detail=detail)


def meeting_sigma(pair: tuple[Features, Features], rig: Rig, parameters: DiagnosisParameters) -> float:
    """Return by how many standard deviations more features meet than if the epipolar lines are displaced.

    Parameters
    ----------
    pair
        Features of the two images, of whatever they show.
    rig
        The calibrated cameras.
    parameters
        How features are counted.

    Returns
    -------
    float
        Standard deviations; 0 if the range of the rig is not known.
    """
    p, values = parameters, []
    first, last, step = p.meeting_offsets_mrad
    beside = np.arange(first, last, step)
    offsets = np.concatenate([[0.0], beside, -beside])
    for count in p.meeting_features:
        rays = [_best(f, count).rays(c) for c, f in zip((rig.left, rig.right), pair, strict=True)]
        try:
            limits = EpipolarParameters(range_fractions=p.range_fractions)
            distance, inside = _epipolar_mrad(rays[0], rays[1], rig, limits)
        except SpinewatchError:
            return 0.0
        i, j = np.nonzero(inside & (np.abs(distance) < last + p.meeting_mrad))
        near = np.abs(distance[i, j] - offsets[:, None]) < p.meeting_mrad
        met = np.array([min(len(np.unique(i[k])), len(np.unique(j[k]))) for k in near])
        values.append((met[0] - met[1:].mean()) / max(met[1:].std(), 1.0))
    return float(np.mean(values))


def _trials(
    pair: Pair, rig: Rig, search: SearchParameters, models: Sequence[TriadModel], p: DiagnosisParameters
) -> Iterator[_Trial]:
    """Yield the pair as given, without a cause, and with every mistake undone."""
    yield _Trial("", "", pair, rig, models, 1)
    yield _Trial(_EXCHANGED, "left and right are exchanged", pair[::-1], rig, models, p.exchange_trials)
    for how, mirror in (("mirrored", (True, False)), ("turned upside down", (True, True))):
        for which, changed in (
            ("both images are", (0, 1)),
            ("the left image is", (0,)),
            ("the right image is", (1,)),
        ):
            undone = [
                _flipped(f, c.image_size_px, mirror) if k in changed else f
                for k, (f, c) in enumerate(zip(pair, (rig.left, rig.right), strict=True))
            ]
            detail = f"{which} {how}"
            cause = _EXCHANGED if all(mirror) and len(changed) == 2 else detail
            yield _Trial(cause, detail, (undone[0], undone[1]), rig, models, p.mirror_trials)
    for size in p.sizes:
        detail = f"markers come out {100 * (size - 1):+.0f}% in size: baseline, vergence or marker are not those given"
        yield _Trial(
            _SIZE, detail, pair, rig, [scaled(m, size) for m in models], p.exchange_trials * len(p.sizes)
        )
    for turn, roll in _rotations(pair, rig, search, models, p):
        right = rig.right.moved(np.array([turn, 0.0, roll]), np.zeros(3))
        detail = (
            "a camera has moved across the epipolar lines: if it was the right one, by about"
            f" {np.degrees(turn):.2f} degrees about its x axis and {np.degrees(roll):.2f} about its optical axis;"
            " calibrate again"
        )
        yield _Trial(_MOVED, detail, pair, Rig(rig.name, rig.left, right), models, p.offset_trials)


def _chain(
    trial: _Trial, search: SearchParameters, expected: int | None, axis: SpineAxis
) -> tuple[int, float]:
    """Return the number of triads in full view of the best chain, and its log-odds."""
    try:
        diameter = max(model.ball_diameter_mm for model in trial.models)
        points = match_features(*trial.pair, trial.rig, diameter, search.matching)
    except (SpinewatchError, np.linalg.LinAlgError):
        return 0, 0.0
    points = likeliest_points(points, search.selection, search.max_points)
    triplets = [identify_triads(points, model, search.identification) for model in trial.models]
    candidates = rate_candidates(triplets, points, trial.models, trial.rig, search.selection, expected)
    return chain_log_odds(candidates, points, search.selection, expected=expected, axis=axis)


def _rotations(
    pair: Pair, rig: Rig, search: SearchParameters, models: Sequence[TriadModel], p: DiagnosisParameters
) -> list[tuple[float, float]]:
    """Return the likeliest rotations of the right camera about x and z, radians, from triplets of equal offset."""
    try:
        t = _offset_triplets(pair, rig, search, models, p)
    except (SpinewatchError, np.linalg.LinAlgError):
        return []
    if not len(t.log_odds):
        return []
    reach = np.radians(p.max_rotation_deg) * 1000
    a, b = np.nonzero(np.triu(~t.exclusive, 1) & (np.abs(t.across[:, None] - t.across) > p.min_across))
    roll = (t.distance_mrad[a] - t.distance_mrad[b]) / (t.across[a] - t.across[b])
    plain = np.column_stack([t.distance_mrad, np.zeros(len(t.distance_mrad))])
    rolled = np.column_stack([t.distance_mrad[a] - roll * t.across[a], roll])[np.abs(roll) <= reach]
    moves = np.concatenate([plain, rolled])
    residual = t.distance_mrad - moves[:, :1] - moves[:, 1:] * t.across
    gain = _independent_gain(np.abs(residual) < p.offset_tolerance_mrad, t)
    gain -= p.roll_log_odds * (moves[:, 1] != 0)
    chosen: list[int] = []
    for k in np.argsort(-gain, kind="stable"):
        if all(
            np.abs(moves[k] - moves[c]) @ [1.0, p.roll_separation_weight] > p.offset_separation_mrad
            for c in chosen
        ):
            chosen.append(int(k))
        if len(chosen) == p.max_offsets:
            break
    return [
        (float(x) / 1000, float(z) / 1000) for x, z in moves[chosen] if np.hypot(x, z) >= p.min_offset_mrad
    ]


def _offset_triplets(
    pair: Pair, rig: Rig, search: SearchParameters, models: Sequence[TriadModel], p: DiagnosisParameters
) -> _Offsets:
    """Return the likeliest triplets whose balls have about the same epipolar distance."""
    left, right = (_best(f, p.max_offset_features) for f in pair)
    rays = (
        left.rays(rig.left, search.matching.extra_sd_mrad),
        right.rays(rig.right, search.matching.extra_sd_mrad),
    )
    distance, inside = _epipolar_mrad(*rays, rig, search.matching.epipolar)
    i, j = np.nonzero(inside & (np.abs(distance) <= np.radians(p.max_rotation_deg) * 1000))
    found = triangulate([rays[0].take(i), rays[1].take(j)])
    score = np.minimum(left.score[i], right.score[j])
    zero = np.zeros(len(i))
    points = Points(found.position_mm, found.covariance_mm2, i, j, found.parallax_mm, found.chi2, zero, score)
    distance = distance[i, j]
    spread = p.triplet_spread_mrad + p.roll_spread * np.radians(p.max_rotation_deg)
    parts, odds = [np.empty((0, 3), dtype=np.intp)], [np.empty(0)]
    for model in models:
        t = identify_triads(points, model, search.identification)
        t = t.take(np.flatnonzero(np.ptp(distance[t.point[:, :3]], axis=1) < spread))
        if not len(t):
            continue
        origin, rotation = approximate_poses(model.coordinates_mm, points.position_mm[t.point])
        facing, tilt = tilt_log_odds(origin, rotation, rig, search.selection)
        log_odds = t.log_odds + tilt + score_log_odds(points.score, search.selection)[t.point].sum(axis=1)
        log_odds -= 0.5 * (np.std(distance[t.point[:, :3]], axis=1) / p.triplet_sd_mrad) ** 2
        parts.append(t.point[facing, :3])
        odds.append(log_odds[facing])
    point, log_odds = np.concatenate(parts), np.concatenate(odds)
    best = np.argsort(-log_odds, kind="stable")[: p.max_triplets]
    point, log_odds = point[best], np.maximum(log_odds[best], 0.0)
    across = rays[1].ideal_mm[j][point].mean(axis=1)[:, 0] / rig.right.focal_length_mm
    shared = [(x[:, None, :, None] == x[None, :, None, :]).any(axis=(2, 3)) for x in (i[point], j[point])]
    return _Offsets(distance[point].mean(axis=1), across, log_odds, shared[0] | shared[1])


def _independent_gain(within: Bool, triplets: _Offsets) -> Float:
    """Return the log-odds (m,) of triplets within (m, t), none of which shares a feature with a likelier one."""
    total, blocked = np.zeros(len(within)), np.zeros(within.shape, dtype=bool)
    for t in range(within.shape[1]):
        taken = within[:, t] & ~blocked[:, t]
        total += taken * triplets.log_odds[t]
        blocked |= taken[:, None] & triplets.exclusive[t]
    return total


def _epipolar_mrad(left: Rays, right: Rays, rig: Rig, parameters: EpipolarParameters) -> tuple[Float, Bool]:
    """Return epipolar distances (n, m) in the right image, mrad, and whether features are in range of each other."""
    limits = range_limits_mm(rig, parameters)
    inside = within_segment(left, right, limits[0], parameters.end_margin)
    inside &= within_segment(right, left, limits[1], parameters.end_margin).T
    normal = np.cross(right.pinhole.centre_mm - left.pinhole.centre_mm, left.vectors)
    size = np.linalg.norm(normal @ right.pinhole.M[:2].T, axis=1)
    return (normal @ right.vectors.T) / size[:, None] / right.pinhole.focal_length_mm * 1000, inside


def _best(features: Features, count: int) -> Features:
    """Return the features with the best scores."""
    return features.take(np.argsort(-features.score, kind="stable")[:count])


def _flipped(features: Features, size_px: tuple[int, int], axes: tuple[bool, bool]) -> Features:
    """Return features of an image that is mirrored along u, v or both."""
    sign = np.where(axes, -1.0, 1.0)
    xy = np.where(axes, np.array(size_px) - 1 - features.xy_px, features.xy_px)
    return replace(features, xy_px=xy, covariance_px2=features.covariance_px2 * np.outer(sign, sign))
