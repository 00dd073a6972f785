"""How a camera may have moved across the epipolar lines: triplets of features with the same epipolar distance.

A rotation of the right camera about its x axis displaces all features across their epipolar lines by about the same
distance, one about its optical axis by a distance that grows across the image. The balls of a triad show it together:
triplets that fit a marker although their balls are off their epipolar lines.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Bool, Float
from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.errors import SpinewatchError
from spinewatch.geometry.transforms import approximate_poses
from spinewatch.geometry.triangulation import triangulate
from spinewatch.markers import TriadModel
from spinewatch.matching.epipolar import epipolar_distance_mrad
from spinewatch.matching.identification import identify_triads
from spinewatch.matching.points import Points
from spinewatch.matching.rating import score_log_odds, tilt_log_odds
from spinewatch.triads.diagnosis_parameters import DiagnosisParameters
from spinewatch.triads.search import SearchParameters


@dataclass(frozen=True, eq=False)
class _OffsetTriplets:
    """Triplets of features whose balls have about the same epipolar distance.

    Mean epipolar distances (t,), mrad, and mean positions across the right image over the focal length (t,), without
    unit; log-odds (t,); whether two triplets share a feature (t, t).
    """

    distance_mrad: Float
    across: Float
    log_odds: Float
    exclusive: Bool


def likeliest_rotations(
    pair: tuple[Features, Features],
    rig: Rig,
    search: SearchParameters,
    models: Sequence[TriadModel],
    parameters: DiagnosisParameters,
) -> list[tuple[float, float]]:
    """Return the rotations of the right camera that put most triplets of features onto their epipolar lines.

    Parameters
    ----------
    pair
        Features of the left and the right image.
    rig
        The calibrated cameras.
    search
        Parameters of the search.
    models
        Markers in use.
    parameters
        Limits of the rotations, and which of them are tried.

    Returns
    -------
    list of tuple
        Rotations about the x and the optical axis of the right camera, radians, the likeliest first.

    References
    ----------
    Not in the thesis.
    """
    p = parameters
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
    pair: tuple[Features, Features],
    rig: Rig,
    search: SearchParameters,
    models: Sequence[TriadModel],
    p: DiagnosisParameters,
) -> _OffsetTriplets:
    """Return the likeliest triplets whose balls have about the same epipolar distance."""
    left, right = (features.best(p.max_offset_features) for features in pair)
    rays = (
        left.rays(rig.left, search.matching.extra_sd_mrad),
        right.rays(rig.right, search.matching.extra_sd_mrad),
    )
    distance, inside = epipolar_distance_mrad(*rays, rig, search.matching.epipolar)
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
    return _OffsetTriplets(distance[point].mean(axis=1), across, log_odds, shared[0] | shared[1])


def _independent_gain(within: Bool, triplets: _OffsetTriplets) -> Float:
    """Return the log-odds (m,) of triplets within (m, t), none of which shares a feature with a likelier one."""
    total, blocked = np.zeros(len(within)), np.zeros(within.shape, dtype=bool)
    for t in range(within.shape[1]):
        taken = within[:, t] & ~blocked[:, t]
        total += taken * triplets.log_odds[t]
        blocked |= taken[:, None] & triplets.exclusive[t]
    return total
