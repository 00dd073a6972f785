"""The choice of the triads: the likeliest row of mutually exclusive candidates along the spine.

The thesis keeps the triplet of least error among rivals (``heuristics``). Here a candidate's log_odds is the
logarithm of how much likelier it is as a triad than by chance: distance errors and parallaxes against their
covariances, tilt against the cameras, feature scores. ``row`` finds the best row of at most the expected
number. So H1 to H3 hold, H5 bounds the number, and H4 enters as a spacing that is regular but unknown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Float, Int
from spinewatch.camera import Rig
from spinewatch.geometry.transforms import approximate_poses
from spinewatch.markers import TriadModel
from spinewatch.matching.chain import ChainCandidates, ChainParameters, best_chain
from spinewatch.matching.identification import Triplets
from spinewatch.matching.points import Points

SpineAxis = Literal["x", "y", "auto"]

_ASSUMED_COUNT = 5
_MOST_TRIADS = 12
_LEAST_VOLUME_MM3 = 200.0**3  # few points do not show how far chance could scatter them
HIDDEN = -1
"""Stands for the image of a ball that a view does not show."""


@dataclass(frozen=True)
class SelectionParameters:
    """What is known of triads before an image is seen.

    ``tilt_sd_deg`` and ``tilt_limit_deg`` of z against the direction of the cameras; ``score_weight`` of a
    point's standardised feature score; ``parallax_limit_sigma``, within which a chance parallax is uniform;
    ``max_candidates`` considered; ``row``, what is known of their row.
    """

    tilt_sd_deg: float = 18.0
    tilt_limit_deg: float = 65.0
    score_weight: float = 0.7
    parallax_limit_sigma: float = 3.5
    max_candidates: int = 200
    row: ChainParameters = field(default_factory=ChainParameters)


@dataclass(frozen=True, eq=False)
class TriadCandidates:
    """c possible triads that face the cameras.

    ``model`` (c,) indices of their markers; ``origin_mm`` (c, 3) and ``rotation`` (c, 3, 3), a rough pose;
    ``log_odds`` (c,), logarithms of odds, each on its own; ``left`` and ``right`` (c, 4) indices of their
    image features in the order of the model's balls, ``HIDDEN`` where a view does not show one, or the marker
    has no fourth.
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
        """Return some of them."""
        i = np.asarray(index)
        return TriadCandidates(*(getattr(self, f.name)[i] for f in fields(self)))

    @property
    def occluded(self) -> NDArray[np.bool_]:
        """Whether a view does not show one of the three first balls (c,)."""
        return np.asarray(np.any((self.left[:, :3] == HIDDEN) | (self.right[:, :3] == HIDDEN), axis=1))

    @classmethod
    def empty(cls) -> TriadCandidates:
        """Return none."""
        none, features = np.empty(0, dtype=np.intp), np.empty((0, 4), dtype=np.intp)
        return cls(none, np.empty((0, 3)), np.empty((0, 3, 3)), np.empty(0), features, features)

    @classmethod
    def joined(cls, parts: Sequence[TriadCandidates]) -> TriadCandidates:
        """Return the candidates of all parts, in their order."""
        return cls(*(np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(cls)))


def select_triads(
    candidates: TriadCandidates,
    points: Points,
    parameters: SelectionParameters,
    *,
    expected: int | None = None,
    axis: SpineAxis = "auto",
) -> Int:
    """Return the indices of the chosen candidates in order along the spine axis, never more than ``expected``.

    With ``axis`` "auto" both object axes are tried and the likelier row is kept.
    """
    if not len(candidates):
        return np.empty(0, dtype=np.intp)
    limit = _MOST_TRIADS if expected is None else expected
    volume = max(float(np.prod(np.ptp(points.position_mm, axis=0))), _LEAST_VOLUME_MM3)
    gaps = np.linalg.norm(candidates.origin_mm[:, None] - candidates.origin_mm, axis=-1)
    exclusive = share_features(candidates) | (gaps < parameters.row.shortest_mm)
    places = ChainCandidates(candidates.origin_mm, candidates.log_odds, exclusive)
    axes = (0, 1) if axis == "auto" else ("xy".index(axis),)
    row, _ = max(
        (best_chain(places, a, volume, limit, parameters.row) for a in axes), key=lambda found: found[1]
    )
    return row


def weigh_candidates(
    triplets: Sequence[Triplets],
    points: Points,
    models: Sequence[TriadModel],
    rig: Rig,
    parameters: SelectionParameters,
    expected: int | None,
) -> TriadCandidates:
    """Return the triplets of each model that face the cameras, strongest first, with the log_odds for each.

    The odds before any log_odds are the expected number of triads to the number of triplets that fit.
    """
    total = sum(map(len, triplets))
    prior = float(np.log((expected or _ASSUMED_COUNT) / max(total, 1)))
    parts = [
        weigh_triplets(found, points, index, model, rig, parameters, prior)
        for index, (found, model) in enumerate(zip(triplets, models, strict=True))
    ]
    pool = TriadCandidates.joined(parts)
    best = np.argsort(-pool.log_odds, kind="stable")[: parameters.max_candidates]
    return pool.take(best)


def weigh_triplets(
    triplets: Triplets,
    points: Points,
    index: int,
    model: TriadModel,
    rig: Rig,
    parameters: SelectionParameters,
    prior: float,
) -> TriadCandidates:
    """Return the triplets of the model with this index that face the cameras, with ``prior`` log-odds each."""
    p = parameters
    origin, rotation = approximate_poses(model.coordinates_mm, points.position_mm[triplets.point])
    facing, tilt_odds = weigh_tilt(origin, rotation, rig, p)
    log_odds = prior + triplets.log_odds + tilt_odds + point_odds(points, p)[triplets.point].sum(axis=1)
    found = TriadCandidates(
        np.full(len(triplets), index, dtype=np.intp),
        origin,
        rotation,
        log_odds,
        padded(points.left_index[triplets.point]),
        padded(points.right_index[triplets.point]),
    )
    return found.take(np.flatnonzero(facing))


def weigh_tilt(
    origin: Float, rotation: Float, rig: Rig, p: SelectionParameters
) -> tuple[NDArray[np.bool_], Float]:
    """Return which markers (n,) face the cameras within the limit, and log-odds of their tilt against chance."""
    towards = (rig.left.centre + rig.right.centre) / 2 - origin
    cosine = (rotation[..., 2] * towards).sum(axis=-1) / np.linalg.norm(towards, axis=-1)
    tilt, sd = np.arccos(np.clip(cosine, -1, 1)), np.radians(p.tilt_sd_deg)
    odds = np.log(2 / sd**2) - 0.5 * (tilt / sd) ** 2
    return np.asarray(tilt <= np.radians(p.tilt_limit_deg)), np.asarray(odds)


def point_odds(points: Points, p: SelectionParameters) -> Float:
    """Return log-odds (n,) of points being balls against chance, by their parallax and score."""
    parallax = -0.5 * (points.chi2 + np.log(2 * np.pi)) + np.log(2 * p.parallax_limit_sigma)
    return np.asarray(parallax + score_odds(points.score, p))


def score_odds(score: Float, p: SelectionParameters) -> Float:
    """Return log-odds (n,) of balls against other features by their scores.

    Standardised scores of balls are taken to be ``score_weight`` above the mean of all.
    """
    spread = score.std() if len(score) else 0.0
    standard = (score - score.mean()) / spread if spread > 0 else np.zeros_like(score)
    return np.asarray(p.score_weight * (standard - p.score_weight / 2))


def share_features(c: TriadCandidates) -> NDArray[np.bool_]:
    """Return (c, c): whether two candidates use the same feature of an image (H2 and H3)."""
    shared = np.zeros((len(c), len(c)), dtype=bool)
    for features in (c.left, c.right):
        used = np.zeros((len(c), int(features.max(initial=0)) + 2), dtype=np.float32)
        np.put_along_axis(used, features + 1, 1.0, axis=1)
        used[:, 0] = 0.0  # hidden balls are nobody's
        shared |= used @ used.T > 0
    return shared


def padded(features: Int) -> Int:
    """Return feature indices (c, n) with ``HIDDEN`` up to four columns."""
    return np.pad(features, ((0, 0), (0, 4 - features.shape[1])), constant_values=HIDDEN)
