"""Model matching: points whose mutual distances are those of a marker (section 5.6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.special import gammaln
from scipy.stats import chi2

from spinewatch.arrays import Float, Int
from spinewatch.markers import TriadModel
from spinewatch.matching.points import Points


@dataclass(frozen=True)
class IdentificationParameters:
    """Limits of a triplet.

    ``tolerance_mm`` bounds each distance error (tau of eq. 5.16). Together the distance errors must fit their
    covariance, to which the making of the marker adds ``model_sd_mm`` per distance; ``loss`` is the share of
    true triads that this discards, 0 for none.
    """

    tolerance_mm: float = 5.0
    loss: float = 0.001
    model_sd_mm: float = 0.2


@dataclass(frozen=True, eq=False)
class Triplets:
    """t candidates of a marker of n balls: triplets, or quadruplets for one of four.

    ``point`` (t, n) indices in the order of the model's balls; ``error_mm`` (t,) of eq. 5.17;
    ``distance_chi2`` (t,) of the distance errors, 3 n - 6 degrees of freedom; ``log_odds`` (t,), logarithm of
    how much likelier these errors are for a true triad than for a chance triplet that passed the limits.
    """

    point: Int
    error_mm: Float
    distance_chi2: Float
    log_odds: Float

    def __len__(self) -> int:
        return len(self.point)

    def take(self, index: object) -> Triplets:
        """Return the triplets chosen by an index or mask array."""
        i = np.asarray(index)
        return Triplets(self.point[i], self.error_mm[i], self.distance_chi2[i], self.log_odds[i])


def identify_triads(
    points: Points, model: TriadModel, parameters: IdentificationParameters, *, distinct_features: bool = True
) -> Triplets:
    """Return every ordered tuple of points that satisfies eq. 5.16, by increasing ``distance_chi2``.

    Points appear once for each of their orders that fits. ``distinct_features`` applies heuristic H1 while
    searching, which is the same and faster. Departs from the thesis by the covariance gate, and by markers of
    four balls, whose mirror images are left out.
    """
    tuples = _fitting_tuples(points, model, parameters, distinct_features)
    tuples = tuples[model.same_hand(points.position_mm[tuples])]
    found = _weigh(tuples, points, model, parameters)
    order = np.argsort(found.distance_chi2, kind="stable")
    limit = float(chi2.isf(parameters.loss, _freedom(model)))
    return found.take(order[found.distance_chi2[order] <= limit])


def distance_errors(balls_mm: Float, model: TriadModel) -> Float:
    """Return measured minus model distances (..., d) of balls (..., n, 3); their norm is eq. 5.17."""
    a, b = (balls_mm[..., k, :] for k in model.pairs.T)
    return np.asarray(np.linalg.norm(a - b, axis=-1) - model.distances_mm)


def within_reach(
    points: Points, distances_mm: Float, tolerance_mm: float, distinct: bool = True
) -> list[Int]:
    """Return for each distance the ordered pairs (p, 2) of points that far from each other, within a tolerance.

    ``distinct`` pairs share no feature.
    """
    pairs = _neighbours(points, float(distances_mm.max()) + tolerance_mm, distinct)
    length = np.linalg.norm(points.position_mm[pairs[:, 0]] - points.position_mm[pairs[:, 1]], axis=1)
    return [pairs[np.abs(length - d) < tolerance_mm] for d in distances_mm]


def log_gate_volume(freedom: int, loss: float) -> float:
    """Return the logarithm of the volume in which whitened errors pass a chi-square gate."""
    radius2 = float(chi2.isf(loss, freedom))
    return float(0.5 * freedom * np.log(np.pi * radius2) - gammaln(freedom / 2 + 1))


def _freedom(model: TriadModel) -> int:
    return 3 * len(model.balls) - 6


def _fitting_tuples(
    points: Points, model: TriadModel, parameters: IdentificationParameters, distinct: bool
) -> Int:
    lists = within_reach(points, model.distances_mm, parameters.tolerance_mm, distinct)
    of_pair = {tuple(pair): i for i, pair in enumerate(model.pairs.tolist())}
    tuples = lists[of_pair[0, 1]]
    for ball in range(2, len(model.balls)):
        tuples = _join(tuples, lists[of_pair[0, ball]], len(points))
        for other in range(1, ball):
            a, b = tuples[:, other], tuples[:, ball]
            length = np.linalg.norm(points.position_mm[a] - points.position_mm[b], axis=1)
            wanted = model.distances_mm[of_pair[other, ball]]
            fits = np.abs(length - wanted) < parameters.tolerance_mm
            tuples = tuples[fits & _distinct(points, a, b) if distinct else fits]
    return tuples


def _weigh(tuples: Int, points: Points, model: TriadModel, parameters: IdentificationParameters) -> Triplets:
    balls = points.position_mm[tuples]
    errors = distance_errors(balls, model)
    S = _error_covariance(balls, points.covariance_mm2[tuples], model.pairs)
    S += parameters.model_sd_mm**2 * np.eye(len(model.pairs))
    surprise = np.einsum("td,td->t", errors, np.linalg.solve(S, errors[..., None])[..., 0])
    k = len(model.pairs)
    half_log_det = 0.5 * np.linalg.slogdet(S)[1]
    density = -0.5 * surprise - half_log_det - 0.5 * k * np.log(2 * np.pi)
    gate = half_log_det + log_gate_volume(_freedom(model), parameters.loss)
    chance = -np.minimum(gate, k * np.log(2 * parameters.tolerance_mm))
    return Triplets(tuples, np.linalg.norm(errors, axis=1), surprise, density - chance)


def _error_covariance(balls_mm: Float, covariances_mm2: Float, pairs: Int) -> Float:
    t, n = balls_mm.shape[:2]
    J = np.zeros((t, len(pairs), n, 3))
    for row, (a, b) in enumerate(pairs):
        u = balls_mm[:, a] - balls_mm[:, b]
        u = u / np.linalg.norm(u, axis=1, keepdims=True)
        J[:, row, a], J[:, row, b] = u, -u
    JS = np.einsum("tdbi,tbij->tdbj", J, covariances_mm2).reshape(t, len(pairs), 3 * n)
    return np.asarray(JS @ np.swapaxes(J.reshape(t, len(pairs), 3 * n), -1, -2))


def _neighbours(points: Points, radius_mm: float, distinct: bool) -> Int:
    if len(points) < 2:
        return np.empty((0, 2), dtype=np.intp)
    pairs = cKDTree(points.position_mm).query_pairs(radius_mm, output_type="ndarray")
    if distinct:
        pairs = pairs[_distinct(points, pairs[:, 0], pairs[:, 1])]
    return np.concatenate([pairs, pairs[:, ::-1]])


def _distinct(points: Points, a: Int, b: Int) -> NDArray[np.bool_]:
    left, right = points.left_index, points.right_index
    return np.asarray((left[a] != left[b]) & (right[a] != right[b]))


def _join(tuples: Int, second: Int, n: int) -> Int:
    """Return all (a, ..., c) with (a, ...) in ``tuples`` and (a, c) in ``second``."""
    second = second[np.argsort(second[:, 0], kind="stable")]
    count = np.bincount(second[:, 0], minlength=n)
    start = np.cumsum(count) - count
    repeats = count[tuples[:, 0]]
    offset = np.arange(repeats.sum()) - np.repeat(np.cumsum(repeats) - repeats, repeats)
    c = second[np.repeat(start[tuples[:, 0]], repeats) + offset, 1]
    return np.column_stack([np.repeat(tuples, repeats, axis=0), c])
