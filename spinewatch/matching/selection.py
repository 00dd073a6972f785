"""Selection of the triads: the most likely chain of candidates that do not exclude each other.

The thesis keeps the triplet of least error among rivals (`spinewatch.thesis_1995.heuristics`). Here every candidate has
log-odds: the logarithm of the ratio of its likelihood as a triad to that by chance, from distance errors and parallaxes
with their covariances, tilt towards the cameras, and feature scores. The best chain of at most the expected number of
candidates is selected. H1 to H3 hold therefore, H5 is the bound of the number, and H4 enters as a spacing that is
regular but unknown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Literal

import numpy as np

from spinewatch.arrays import Bool, Float, Int
from spinewatch.camera import Rig
from spinewatch.detection.features import HIDDEN
from spinewatch.geometry.transforms import approximate_poses
from spinewatch.markers import TriadModel
from spinewatch.matching.chain import ChainCandidates, ChainParameters, best_chain
from spinewatch.matching.identification import Triplets
from spinewatch.matching.points import Points

SpineAxis = Literal["x", "y", "auto"]

MAX_BALLS = 4
"""Largest number of balls of a marker: columns of the feature indices of candidates."""


@dataclass(frozen=True)
class SelectionParameters:
    """Prior knowledge of triads, and limits of their selection.

    Attributes
    ----------
    tilt_sd_deg
        Standard deviation per axis of the tilt of a marker's z from the direction of the cameras, degrees.
    max_tilt_deg
        Largest tilt, degrees.
    score_weight
        Difference of the mean standardized feature scores of balls and of all features.
    assumed_count
        Number of triads assumed for the prior odds when it is not given.
    max_count
        Largest number of triads selected when it is not given.
    min_volume_mm3
        Smallest volume in which chance triads are taken to be distributed, mm^3; a few points do not span it.
    max_candidates
        Number of candidates considered, the most likely first.
    surplus_log_odds
        Log-odds, beyond `ChainParameters.min_log_odds`, that each triad beyond the expected number must add to the
        chain; 2.3 is 10 to 1.
    chain
        Prior knowledge of the chain of triads.
    """

    tilt_sd_deg: float = 18.0
    max_tilt_deg: float = 65.0
    score_weight: float = 0.7
    assumed_count: int = 5
    max_count: int = 12
    min_volume_mm3: float = 200.0**3
    max_candidates: int = 200
    surplus_log_odds: float = 2.3
    chain: ChainParameters = field(default_factory=ChainParameters)


@dataclass(frozen=True, eq=False)
class TriadCandidates:
    """c candidate triads that face the cameras.

    Attributes
    ----------
    model
        Indices of their markers, shape (c,).
    origin_mm
        Approximate origins, shape (c, 3), object space, mm.
    rotation
        Approximate rotations from marker to object axes, shape (c, 3, 3).
    log_odds
        Log-odds of each on its own, shape (c,).
    left, right
        Indices of features in the order of the model's balls, shape (c, 4); `HIDDEN` where an image does not show a
        ball or the marker has no fourth.
    """

    model: Int
    origin_mm: Float
    rotation: Float
    log_odds: Float
    left: Int
    right: Int

    def __len__(self) -> int:
        return len(self.model)

    def take(self, index: object) -> TriadCandidates:
        """Return a selection of the candidates.

        Parameters
        ----------
        index
            Index or mask array.

        Returns
        -------
        TriadCandidates
            The selected candidates, in the order of the index.
        """
        i = np.asarray(index)
        return TriadCandidates(*(getattr(self, f.name)[i] for f in fields(self)))

    @classmethod
    def empty(cls) -> TriadCandidates:
        """Return no candidates.

        Returns
        -------
        TriadCandidates
            Arrays of length 0.
        """
        none, features = np.empty(0, dtype=np.intp), np.empty((0, MAX_BALLS), dtype=np.intp)
        return cls(none, np.empty((0, 3)), np.empty((0, 3, 3)), np.empty(0), features, features)

    @classmethod
    def concatenate(cls, parts: Sequence[TriadCandidates]) -> TriadCandidates:
        """Return the candidates of several sets.

        Parameters
        ----------
        parts
            At least one set of candidates.

        Returns
        -------
        TriadCandidates
            All of them, in their order.
        """
        return cls(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(cls)))


def select_triads(
    candidates: TriadCandidates,
    points: Points,
    parameters: SelectionParameters,
    *,
    expected: int | None = None,
    axis: SpineAxis = "auto",
) -> Int:
    """Return the candidates of the most likely chain.

    Parameters
    ----------
    candidates
        Candidate triads.
    points
        All triangulated points; their extent is the volume of chance triads.
    parameters
        Prior knowledge and limits.
    expected
        Number of triads placed, which is never exceeded; None if it is not known.
    axis
        Object axis along which the spine extends; "auto" tries both and keeps the more likely chain.

    Returns
    -------
    Int
        Indices of the selected candidates in order along the axis, shape (k,).
    """
    if not len(candidates):
        return np.empty(0, dtype=np.intp)
    max_length = parameters.max_count if expected is None else expected
    chain = _chain_candidates(candidates, parameters)
    return _best_chain(chain, points, parameters, max_length, axis)[0]


def chain_log_odds(
    candidates: TriadCandidates,
    points: Points,
    parameters: SelectionParameters,
    *,
    expected: int | None = None,
    axis: SpineAxis = "auto",
) -> tuple[int, float]:
    """Return the length and the log-odds of the most likely chain.

    Parameters
    ----------
    candidates
        Candidate triads.
    points
        All triangulated points; their extent is the volume of chance triads.
    parameters
        Prior knowledge and limits.
    expected
        Number of triads placed, which is never exceeded; None if it is not known.
    axis
        Object axis along which the spine extends.

    Returns
    -------
    length : int
        Number of members.
    log_odds : float
        Log-odds of the chain, 0 for an empty one.
    """
    if not len(candidates):
        return 0, 0.0
    max_length = parameters.max_count if expected is None else expected
    chain = _chain_candidates(candidates, parameters)
    members, log_odds = _best_chain(chain, points, parameters, max_length, axis)
    return len(members), log_odds


def surplus_triads(
    candidates: TriadCandidates,
    points: Points,
    selected: Int,
    parameters: SelectionParameters,
    *,
    axis: SpineAxis = "auto",
) -> Int:
    """Return the most likely chain of the selected candidates and of others beside them, whatever number is expected.

    Parameters
    ----------
    candidates
        Candidate triads.
    points
        All triangulated points; their extent is the volume of chance triads.
    selected
        Indices of the selected candidates, shape (k,).
    parameters
        Prior knowledge and limits.
    axis
        Object axis along which the spine extends.

    Returns
    -------
    Int
        Indices of the chain if it contains the selected candidates and each other member adds at least
        `SelectionParameters.surplus_log_odds`; otherwise ``selected``.
    """
    chain = _chain_candidates(candidates, parameters)
    beside = np.all(~chain.exclusive[selected], axis=0)
    beside[selected] = False
    if not len(selected) or not beside.any():
        return selected
    pool = np.concatenate([selected, np.flatnonzero(beside)])
    longer, log_odds = _best_chain(chain.take(pool), points, parameters, parameters.max_count, axis)
    surplus = len(longer) - len(selected)
    if surplus <= 0 or not np.isin(np.arange(len(selected)), longer).all():
        return selected
    _, without = _best_chain(chain.take(selected), points, parameters, parameters.max_count, axis)
    return pool[longer] if log_odds - without >= surplus * parameters.surplus_log_odds else selected


def _chain_candidates(candidates: TriadCandidates, parameters: SelectionParameters) -> ChainCandidates:
    """Return the candidates as members of the chain; they exclude each other if they share a feature or would touch."""
    gaps = np.linalg.norm(candidates.origin_mm[:, None] - candidates.origin_mm, axis=-1)
    exclusive = share_features(candidates) | (gaps < parameters.chain.min_gap_mm)
    return ChainCandidates(candidates.origin_mm, candidates.log_odds, exclusive)


def _best_chain(
    candidates: ChainCandidates,
    points: Points,
    parameters: SelectionParameters,
    max_length: int,
    axis: SpineAxis,
) -> tuple[Int, float]:
    """Return the indices (k,) of the most likely chain, and its log-odds."""
    volume = chance_volume_mm3(points, parameters)
    axes = (0, 1) if axis == "auto" else ("xy".index(axis),)
    return max(
        (best_chain(candidates, a, volume, max_length, parameters.chain) for a in axes),
        key=lambda found: found[1],
    )


def chance_volume_mm3(points: Points, parameters: SelectionParameters) -> float:
    """Return the volume in which chance triads are taken to be uniformly distributed.

    Parameters
    ----------
    points
        All triangulated points, at least one.
    parameters
        Its smallest value.

    Returns
    -------
    float
        Volume of the points' extent, mm^3.
    """
    return max(float(np.prod(np.ptp(points.position_mm, axis=0))), parameters.min_volume_mm3)


def rate_candidates(
    triplets: Sequence[Triplets],
    points: Points,
    models: Sequence[TriadModel],
    rig: Rig,
    parameters: SelectionParameters,
    expected: int | None,
) -> TriadCandidates:
    """Return the tuples of all markers as candidates with their log-odds.

    Parameters
    ----------
    triplets
        Tuples of points of each marker.
    points
        Triangulated points.
    models
        The markers.
    rig
        The calibrated cameras.
    parameters
        Prior knowledge and limits.
    expected
        Number of triads placed, None if it is not known. Divided by the number of tuples, it is the prior odds.

    Returns
    -------
    TriadCandidates
        Candidates that face the cameras, the most likely first.
    """
    total = sum(map(len, triplets))
    prior = float(np.log((expected or parameters.assumed_count) / max(total, 1)))
    parts = [
        rate_triplets(found, points, index, model, rig, parameters, prior)
        for index, (found, model) in enumerate(zip(triplets, models, strict=True))
    ]
    candidates = TriadCandidates.concatenate(parts)
    best = np.argsort(-candidates.log_odds, kind="stable")[: parameters.max_candidates]
    return candidates.take(best)


def rate_triplets(
    triplets: Triplets,
    points: Points,
    index: int,
    model: TriadModel,
    rig: Rig,
    parameters: SelectionParameters,
    prior: float,
) -> TriadCandidates:
    """Return the tuples of one marker as candidates with their log-odds.

    Parameters
    ----------
    triplets
        Tuples of points.
    points
        Triangulated points.
    index
        Index of the marker.
    model
        The marker.
    rig
        The calibrated cameras.
    parameters
        Prior knowledge and limits.
    prior
        Prior log-odds of each tuple.

    Returns
    -------
    TriadCandidates
        Candidates that face the cameras, in the order of the tuples.
    """
    origin, rotation = approximate_poses(model.coordinates_mm, points.position_mm[triplets.point])
    facing, tilt = tilt_log_odds(origin, rotation, rig, parameters)
    balls = point_log_odds(points, parameters)[triplets.point].sum(axis=1)
    candidates = TriadCandidates(
        np.full(len(triplets), index, dtype=np.intp),
        origin,
        rotation,
        prior + triplets.log_odds + tilt + balls,
        pad_features(points.left_index[triplets.point]),
        pad_features(points.right_index[triplets.point]),
    )
    return candidates.take(np.flatnonzero(facing))


def tilt_log_odds(
    origin_mm: Float, rotation: Float, rig: Rig, parameters: SelectionParameters
) -> tuple[Bool, Float]:
    """Return whether markers face the cameras, and the log-odds of their tilt.

    Parameters
    ----------
    origin_mm
        Origins of n markers, shape (n, 3), object space, mm.
    rotation
        Rotations from marker to object axes, shape (n, 3, 3).
    rig
        The calibrated cameras.
    parameters
        Distribution and limit of the tilt.

    Returns
    -------
    facing : Bool
        Whether the tilt is within the limit, shape (n,).
    log_odds : Float
        Logarithm of the density of the tilt to that of a random direction, shape (n,).
    """
    towards = (rig.left.centre + rig.right.centre) / 2 - origin_mm
    cosine = (rotation[..., 2] * towards).sum(axis=-1) / np.linalg.norm(towards, axis=-1)
    tilt, sd = np.arccos(np.clip(cosine, -1, 1)), np.radians(parameters.tilt_sd_deg)
    log_odds = np.log(2 / sd**2) - 0.5 * (tilt / sd) ** 2
    return np.asarray(tilt <= np.radians(parameters.max_tilt_deg)), np.asarray(log_odds)


def point_log_odds(points: Points, parameters: SelectionParameters) -> Float:
    """Return the log-odds of points as balls, from their parallaxes and scores.

    Parameters
    ----------
    points
        n triangulated points.
    parameters
        Distribution of the scores.

    Returns
    -------
    Float
        Log-odds, shape (n,).
    """
    return np.asarray(points.log_odds + score_log_odds(points.score, parameters))


def likeliest_points(points: Points, parameters: SelectionParameters, count: int) -> Points:
    """Return the points that are most likely balls.

    Parameters
    ----------
    points
        Triangulated points.
    parameters
        Distribution of the scores.
    count
        Largest number of points.

    Returns
    -------
    Points
        At most ``count`` of them, in their order.
    """
    if len(points) <= count:
        return points
    order = np.argsort(-point_log_odds(points, parameters), kind="stable")
    return points.take(np.sort(order[:count]))


def score_log_odds(score: Float, parameters: SelectionParameters) -> Float:
    """Return the log-odds of features as balls, from their scores.

    Standardized scores are modelled as normal with unit variance, with mean `score_weight` for balls and 0 for other
    features.

    Parameters
    ----------
    score
        Scores, shape (n,).
    parameters
        Distribution of the scores.

    Returns
    -------
    Float
        Log-odds, shape (n,).

    Examples
    --------
    >>> import numpy as np
    >>> score_log_odds(np.array([0.2, 0.8]), SelectionParameters())
    array([-0.945,  0.455])
    """
    spread = score.std() if len(score) else 0.0
    standard = (score - score.mean()) / spread if spread > 0 else np.zeros_like(score)
    return np.asarray(parameters.score_weight * (standard - parameters.score_weight / 2))


def share_features(candidates: TriadCandidates) -> Bool:
    """Return whether two candidates use the same feature of an image.

    Parameters
    ----------
    candidates
        c candidate triads.

    Returns
    -------
    Bool
        Whether two of them share a feature, shape (c, c).

    References
    ----------
    Heuristics H2 and H3 of thesis section 5.6.
    """
    shared = np.zeros((len(candidates), len(candidates)), dtype=bool)
    for features in (candidates.left, candidates.right):
        used = np.zeros((len(candidates), int(features.max(initial=0)) + 2), dtype=np.float32)
        np.put_along_axis(used, features + 1, 1.0, axis=1)
        used[:, 0] = 0.0  # column of HIDDEN
        shared |= used @ used.T > 0
    return shared


def pad_features(features: Int) -> Int:
    """Return feature indices with a column for each possible ball.

    Parameters
    ----------
    features
        Indices, shape (c, n).

    Returns
    -------
    Int
        Indices, shape (c, 4), with `HIDDEN` in the columns added.
    """
    return np.pad(features, ((0, 0), (0, MAX_BALLS - features.shape[1])), constant_values=HIDDEN)
