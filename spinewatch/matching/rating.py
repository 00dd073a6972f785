"""Log-odds of candidate triads: each on its own, before those that exclude each other are compared.

They are the logarithm of the ratio of its likelihood as a triad to that by chance, from distance errors and parallaxes
with their covariances, tilt towards the cameras, and feature scores.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from spinewatch.arrays import Bool, Float
from spinewatch.camera import Rig
from spinewatch.geometry.transforms import approximate_poses
from spinewatch.markers import TriadModel
from spinewatch.matching.identification import Triplets
from spinewatch.matching.points import Points
from spinewatch.matching.selection_parameters import SelectionParameters
from spinewatch.matching.triad_candidates import TriadCandidates, pad_features


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
