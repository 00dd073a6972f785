"""Ambiguity of a marker: how well its balls are told apart, and from those of the next vertebra."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise, permutations

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.camera import Rig
from spinewatch.geometry.triangulation import triangulate
from spinewatch.markers import TriadModel
from spinewatch.triads.pose import Pose, ball_centres


@dataclass(frozen=True)
class MarkerAmbiguity:
    """How well triplets of balls are told apart by their distances.

    Attributes
    ----------
    difference_mm
        Smallest difference between two of the marker's distances, mm.
    difference_sd_mm
        Largest standard deviation with which that difference is measured in one of the poses, mm.
    neighbour_mm
        Largest distance error of the best wrong triplet, two balls of a vertebra and one of the next, taken for the
        marker, mm; NaN when there is one vertebra only. A tolerance below it excludes such triplets.
    """

    difference_mm: float
    difference_sd_mm: float
    neighbour_mm: float


def marker_ambiguity(rig: Rig, model: TriadModel, poses: Sequence[Pose], sigma_px: float) -> MarkerAmbiguity:
    """Return how well the balls of a marker of three are told apart.

    Parameters
    ----------
    rig
        The calibrated cameras.
    model
        The marker, of three balls.
    poses
        True poses along the spine; covariances are ignored.
    sigma_px
        Standard deviation of a ball's centre, per axis, px.

    Returns
    -------
    MarkerAmbiguity
        Differences of distances.

    References
    ----------
    Thesis eq. 5.16, and section 7.2, Correspondence, recommendation 1, for markers that are told apart better.

    Examples
    --------
    >>> from spinewatch.markers import FLAT_10_14_18
    >>> from spinewatch.planning.accuracy import straight_chain
    >>> from spinewatch.planning.planned_rig import planned_rig
    >>> rig = planned_rig()
    >>> ambiguity = marker_ambiguity(rig, FLAT_10_14_18, straight_chain(("T9", "T8"), np.zeros(3), 50.0), 0.1)
    >>> round(ambiguity.difference_mm, 1)
    5.2
    """
    order = np.argsort(model.distances_mm)
    gaps = np.diff(model.distances_mm[order])
    least = int(np.argmin(gaps))
    pairs = model.pairs[order[[least + 1, least]]]
    balls = ball_centres(poses, model)
    return MarkerAmbiguity(
        difference_mm=float(gaps[least]),
        difference_sd_mm=float(np.sqrt(_difference_variances(rig, balls, sigma_px, pairs).max())),
        neighbour_mm=min(
            (_best_wrong_triplet(model, first, second) for first, second in pairwise(balls)),
            default=float("nan"),
        ),
    )


def _difference_variances(rig: Rig, balls: Float, sigma_px: float, pairs: Int) -> Float:
    """Return variances (t,) of the difference of two distances between triangulated balls (t, 3, 3), mm^2."""
    points = balls.reshape(-1, 3)
    rays = [camera.rays(camera.project(points), sigma_px**2 * np.eye(2)) for camera in (rig.left, rig.right)]
    covariance = triangulate(rays).covariance_mm2.reshape(len(balls), 3, 3, 3)
    gradient = np.zeros_like(balls)
    for sign, (a, b) in zip((1.0, -1.0), pairs, strict=True):
        along = balls[:, a] - balls[:, b]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        gradient[:, a] += sign * along
        gradient[:, b] -= sign * along
    return np.asarray(np.einsum("tbi,tbij,tbj->t", gradient, covariance, gradient))


def _best_wrong_triplet(model: TriadModel, first: Float, second: Float) -> float:
    """Return the smallest of the largest distance errors of triplets with balls of two triads (3, 3), mm."""
    both = np.vstack([first, second])
    triplets = [
        order
        for chosen in combinations(range(6), 3)
        if chosen not in ((0, 1, 2), (3, 4, 5))
        for order in permutations(chosen)
    ]
    corners = both[np.array(triplets)]
    a, b = model.pairs.T
    distances = np.linalg.norm(corners[:, a] - corners[:, b], axis=-1)
    return float(np.abs(distances - model.distances_mm).max(axis=1).min())
