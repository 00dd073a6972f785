"""Pairs of points that may be two balls of a marker, and the candidate triads of which only these are seen."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.detection.features import HIDDEN
from spinewatch.markers import TriadModel
from spinewatch.matching.identification import (
    chi2_limit,
    distance_chi2,
    log_gate_volume,
    pairs_at_distances,
)
from spinewatch.matching.points import Points
from spinewatch.matching.rating import point_log_odds
from spinewatch.matching.selection_parameters import SelectionParameters
from spinewatch.matching.triad_candidates import MAX_BALLS, TriadCandidates
from spinewatch.triads.third_ball import frames_near_z


@dataclass(frozen=True, eq=False)
class BallPairs:
    """p pairs of points that may be the same two balls of a marker.

    Attributes
    ----------
    balls
        Indices of the two balls.
    distance_mm
        Their distance on the marker, mm.
    point
        Indices of the points, shape (p, 2).
    chi2
        Chi-squares of their distances, shape (p,), one degree of freedom.
    """

    balls: tuple[int, int]
    distance_mm: float
    point: Int
    chi2: Float

    def take(self, index: object) -> BallPairs:
        """Return a selection of the pairs.

        Parameters
        ----------
        index
            Index or mask array.

        Returns
        -------
        BallPairs
            The selected pairs, in the order of the index.
        """
        i = np.asarray(index)
        return replace(self, point=self.point[i], chi2=self.chi2[i])

    def features(self, used: Int, n_balls: int) -> Int:
        """Return the features of one image that the pairs use.

        Parameters
        ----------
        used
            Index of the feature of each point.
        n_balls
            Number of columns.

        Returns
        -------
        Int
            Features in the columns of the two balls, `HIDDEN` in the others, shape (p, n_balls).
        """
        table = np.full((len(self.point), n_balls), HIDDEN)
        table[:, self.balls] = used[self.point]
        return table


def ball_pairs(
    points: Points, model: TriadModel, tolerance_mm: float, model_sd_mm: float, significance: float
) -> list[BallPairs]:
    """Return the pairs of points whose distance fits two balls of a marker.

    Parameters
    ----------
    points
        Triangulated points.
    model
        The marker.
    tolerance_mm
        Largest error of the distance, mm.
    model_sd_mm
        Standard deviation of that distance as manufactured, mm.
    significance
        Probability that the chi-square test of the distance discards a true pair.

    Returns
    -------
    list of BallPairs
        Pairs of points for each two balls of the marker.
    """
    lists = pairs_at_distances(points, model.distances_mm, tolerance_mm)
    limit, found = chi2_limit(1, significance), []
    for (a, b), distance, point in zip(model.pairs.tolist(), model.distances_mm.tolist(), lists, strict=True):
        chi2 = distance_chi2(points, point, distance, model_sd_mm)
        found.append(BallPairs((a, b), distance, point, chi2).take(chi2 <= limit))
    return found


def pair_candidates(
    pairs: Iterable[BallPairs],
    points: Points,
    index: int,
    model: TriadModel,
    selection: SelectionParameters,
    significance: float,
) -> TriadCandidates:
    """Return candidate triads of which both images show two balls and neither shows the third.

    Parameters
    ----------
    pairs
        Pairs of points that may be two balls of the marker.
    points
        The points.
    index
        Index of the marker.
    model
        The marker, of three balls.
    selection
        Prior knowledge of triads.
    significance
        Probability with which the chi-square test of the distance has discarded a true pair.

    Returns
    -------
    TriadCandidates
        One candidate per pair, its rotation about the line through the balls such that its z is near Z.
    """
    ball_odds = point_log_odds(points, selection)
    log_gate = log_gate_volume(1, significance)
    parts = [TriadCandidates.empty()]
    for found in pairs:
        i, j = found.point.T
        along = points.position_mm[j] - points.position_mm[i]
        u = along / np.linalg.norm(along, axis=1, keepdims=True)
        fit_odds = -0.5 * found.chi2 - 0.5 * np.log(2 * np.pi) + log_gate
        A, B = (model.coordinates_mm[ball] for ball in found.balls)
        rotation = frames_near_z(u) @ frames_near_z(((B - A) / found.distance_mm)[None])[0].T
        origin = (points.position_mm[i] + points.position_mm[j]) / 2 - rotation @ ((A + B) / 2)
        left, right = (found.features(used, MAX_BALLS) for used in (points.left_index, points.right_index))
        kinds = np.full(len(i), index, dtype=np.intp)
        log_odds = fit_odds + (ball_odds[i] + ball_odds[j])  # exactly the same for both orders of a pair
        parts.append(TriadCandidates(kinds, origin, rotation, log_odds, left, right))
    return TriadCandidates.concatenate(parts)
