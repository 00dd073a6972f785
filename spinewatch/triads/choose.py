"""The choice of the triads: the likeliest row of mutually exclusive triplets along the spine.

The thesis keeps the triplet of least error among rivals (``heuristics``). Here a triplet's evidence is the
logarithm of how much likelier it is as a triad than by chance: distance errors and parallaxes against their
covariances, tilt against the cameras, feature scores. A row gains by evenly spaced neighbours, and dynamic
programming along the spine axis finds the best row of at most the expected number. So H1 to H3 hold, H5
bounds the number, and H4 enters as a spacing that is even but unknown.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from spinewatch.camera import Float, Rig
from spinewatch.correspondence.matcher import Points
from spinewatch.triads.identify import IdentifyParameters, Int, Triplets
from spinewatch.triads.model import TriadModel
from spinewatch.triads.pose import position_and_normal

SpineAxis = Literal["x", "y", "auto"]

_ASSUMED_COUNT = 5
_MOST_TRIADS = 12
_MOST_STEPS = 3  # a row may lack two neighbours in succession
_LEAST_VOLUME_MM3 = 200.0**3  # few points do not show how far chance could scatter them


@dataclass(frozen=True)
class ChooseParameters:
    """What is known of triads before an image is seen.

    ``tilt_sd_deg`` and ``tilt_limit_deg`` of a normal against the direction of the cameras; ``score_weight``
    of a point's standardised feature score; ``parallax_limit_sigma``, within which a chance parallax is
    uniform; ``spacing_mm`` (least, most) of neighbours; ``spacing_sd``, a row's relative irregularity;
    ``slope_sd`` and ``slope_limit`` of the row against the spine axis, sideways and in height;
    ``missing_log_odds`` of an unseen triad inside the row; ``least_log_odds`` that a triad must add (5 is 150
    to 1); ``most_candidates`` considered.
    """

    tilt_sd_deg: float = 25.0
    tilt_limit_deg: float = 65.0
    score_weight: float = 0.7
    parallax_limit_sigma: float = 3.5
    spacing_mm: tuple[float, float] = (30.0, 80.0)
    spacing_sd: float = 0.12
    slope_sd: float = 0.35
    slope_limit: float = 1.2
    missing_log_odds: float = -3.0
    least_log_odds: float = 5.0
    most_candidates: int = 200


@dataclass(frozen=True, eq=False)
class Candidates:
    """Triplets that face the cameras, strongest first.

    ``index`` (c,) into the triplets; ``origin_mm`` (c, 3); ``evidence`` (c,), logarithms of odds, each on its
    own; ``left`` and ``right`` (c, 3) indices of their image features.
    """

    index: Int
    origin_mm: Float
    evidence: Float
    left: Int
    right: Int


def choose_triads(
    triplets: Triplets,
    points: Points,
    model: TriadModel,
    rig: Rig,
    identify: IdentifyParameters,
    parameters: ChooseParameters,
    *,
    expected: int | None = None,
    axis: SpineAxis = "auto",
) -> Int:
    """Return the indices of the chosen triplets in order along the spine axis, never more than ``expected``.

    With ``axis`` "auto" both object axes are tried and the likelier row is kept.
    """
    if not len(triplets):
        return np.empty(0, dtype=np.intp)
    candidates = weigh_candidates(
        triplets, points, model, rig, identify, parameters, expected or _ASSUMED_COUNT
    )
    if not len(candidates.index):
        return np.empty(0, dtype=np.intp)
    limit = _MOST_TRIADS if expected is None else expected
    volume = max(float(np.prod(np.ptp(points.position_mm, axis=0))), _LEAST_VOLUME_MM3)
    axes = (0, 1) if axis == "auto" else ("xy".index(axis),)
    rows = [best_row(candidates, a, volume, limit, parameters) for a in axes]
    row, _ = max(rows, key=lambda found: found[1])
    return candidates.index[row]


def weigh_candidates(
    triplets: Triplets,
    points: Points,
    model: TriadModel,
    rig: Rig,
    identify: IdentifyParameters,
    parameters: ChooseParameters,
    expected: int,
) -> Candidates:
    """Return the triplets that face the cameras with the evidence for each on its own.

    The odds before any evidence are the expected number of triads to the number of triplets that fit the
    model.
    """
    p = parameters
    origin, normal = position_and_normal(model.coordinates_mm, points.position_mm[triplets.point])
    tilt = _tilt_rad(origin, normal, rig)
    sd = np.radians(p.tilt_sd_deg)
    chance_of_errors = -3 * np.log(2 * identify.tolerance_mm)
    parallax = -0.5 * (points.chi2 + np.log(2 * np.pi)) + np.log(2 * p.parallax_limit_sigma)
    score = p.score_weight * (_standardised(points.score) - p.score_weight / 2)
    evidence = (
        np.log(expected / max(len(triplets), 1))
        + (triplets.log_density - chance_of_errors)
        + (np.log(2 / sd**2) - 0.5 * (tilt / sd) ** 2)
        + (parallax + score)[triplets.point].sum(axis=1)
    )
    facing = np.flatnonzero(tilt <= np.radians(p.tilt_limit_deg))
    best = facing[np.argsort(-evidence[facing], kind="stable")][: p.most_candidates]
    chosen = triplets.point[best]
    return Candidates(
        best, origin[best], evidence[best], points.left_index[chosen], points.right_index[chosen]
    )


def best_row(
    candidates: Candidates, axis: int, volume_mm3: float, limit: int, parameters: ChooseParameters
) -> tuple[Int, float]:
    """Return the candidates (k,) of the likeliest row, in order along the axis, and its logarithm of odds.

    Dynamic programming over the number of triads; the spacing is one of a list, the same along a row. An
    empty row has odds of 0.
    """
    spacings = np.geomspace(*parameters.spacing_mm, 10)
    worth = candidates.evidence - parameters.least_log_odds
    steps = _step_gains(candidates, axis, volume_mm3, spacings, parameters)
    value = np.tile(worth, (len(spacings), 1))
    best, row = 0.0, np.empty(0, dtype=np.intp)
    before: list[Int] = []
    for count in range(1, limit + 1):
        s, last = np.unravel_index(np.argmax(value), value.shape)
        if value[s, last] > best:
            best, row = float(value[s, last]), _trace(before, int(s), int(last))
        if count == limit:
            break
        total = value[:, :, None] + steps
        before.append(total.argmax(axis=1))
        value = total.max(axis=1) + worth
        if not np.any(value > -np.inf):
            break
    return row, best


def _trace(before: list[Int], spacing: int, last: int) -> Int:
    row = [last]
    for previous in reversed(before):
        row.append(int(previous[spacing, row[-1]]))
    return np.array(row[::-1], dtype=np.intp)


def _step_gains(c: Candidates, axis: int, volume_mm3: float, spacings: Float, p: ChooseParameters) -> Float:
    """Return (s, c, c): how much likelier j lies where it is as i's next neighbour than by chance."""
    d = c.origin_mm[None] - c.origin_mm[:, None]
    along = d[..., axis]
    with np.errstate(divide="ignore", invalid="ignore"):
        slopes = np.delete(d, axis, axis=-1) / along[..., None]
    possible = (along > 0) & np.all(np.abs(slopes) <= p.slope_limit, axis=-1) & ~_share_features(c)
    i, j = np.nonzero(possible)
    length, slope = np.linalg.norm(d[i, j], axis=1), slopes[i, j]
    direction = -0.5 * ((slope / p.slope_sd) ** 2).sum(axis=1) - np.log(
        2 * np.pi * p.slope_sd**2 * along[i, j] ** 2
    )
    number = np.arange(1, _MOST_STEPS + 1)[:, None, None]
    sd = p.spacing_sd * np.sqrt(1 / number)
    off = (np.log(length) - np.log(number * spacings[:, None])) / sd
    spacing = -0.5 * off**2 - np.log(np.sqrt(2 * np.pi) * sd * length) + p.missing_log_odds * (number - 1)
    gains = np.full((len(spacings), *possible.shape), -np.inf)
    gains[:, i, j] = spacing.max(axis=0) + direction + np.log(volume_mm3)
    return gains


def _share_features(c: Candidates) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Return (c, c): whether two triplets use the same feature of an image (H2 and H3)."""
    shared = np.zeros((len(c.index), len(c.index)), dtype=bool)
    for features in (c.left, c.right):
        used = np.zeros((len(c.index), int(features.max()) + 1), dtype=np.float32)
        np.put_along_axis(used, features, 1.0, axis=1)
        shared |= used @ used.T > 0
    return shared


def _tilt_rad(origin: Float, normal: Float, rig: Rig) -> Float:
    towards = (rig.left.centre + rig.right.centre) / 2 - origin
    cosine = (normal * towards).sum(axis=-1) / np.linalg.norm(towards, axis=-1)
    return np.asarray(np.arccos(np.clip(cosine, -1, 1)))


def _standardised(score: Float) -> Float:
    spread = score.std()
    return (score - score.mean()) / spread if spread > 0 else np.zeros_like(score)
