"""Model matching: triplets of points whose mutual distances are those of a triad (section 5.6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from spinewatch.camera import Float
from spinewatch.correspondence.matcher import Points
from spinewatch.triads.model import TriadModel

Int = NDArray[np.intp]
_PAIRS = ((0, 1), (0, 2), (1, 2))


@dataclass(frozen=True)
class IdentifyParameters:
    """Limits of a triplet.

    ``tolerance_mm`` bounds each distance error (tau of eq. 5.16); ``chi2_limit`` bounds the three distance
    errors together in units of their covariance, to which the making of the marker adds ``model_sd_mm`` per
    distance (16.3 is exceeded by one true triad in a thousand).
    """

    tolerance_mm: float = 5.0
    chi2_limit: float = 16.3
    model_sd_mm: float = 0.2


@dataclass(frozen=True, eq=False)
class Triplets:
    """t candidates of a triad.

    ``point`` (t, 3) indices in the order of the model's balls; ``error_mm`` (t,) of eq. 5.17;
    ``distance_chi2`` (t,) of the three distance errors, three degrees of freedom; ``log_density`` (t,), the
    logarithm of their normal density per mm^3.
    """

    point: Int
    error_mm: Float
    distance_chi2: Float
    log_density: Float

    def __len__(self) -> int:
        return len(self.point)

    def take(self, index: object) -> Triplets:
        """Return the triplets chosen by an index or mask array."""
        i = np.asarray(index)
        return Triplets(self.point[i], self.error_mm[i], self.distance_chi2[i], self.log_density[i])


def identify_triads(
    points: Points, model: TriadModel, parameters: IdentifyParameters, *, distinct_features: bool = True
) -> Triplets:
    """Return every ordered triplet of points that satisfies eq. 5.16, by increasing ``distance_chi2``.

    A triplet appears once for each of its six orders that fits. ``distinct_features`` applies heuristic H1
    while searching, which is the same and faster. Departs from the thesis by the covariance gate.
    """
    pairs = _neighbours(points, float(model.distances_mm.max()) + parameters.tolerance_mm, distinct_features)
    length = np.linalg.norm(points.position_mm[pairs[:, 0]] - points.position_mm[pairs[:, 1]], axis=1)
    lists = [pairs[np.abs(length - d) < parameters.tolerance_mm] for d in model.distances_mm]
    triplets = _join(lists[0], lists[1], len(points))
    side = np.linalg.norm(points.position_mm[triplets[:, 1]] - points.position_mm[triplets[:, 2]], axis=1)
    triplets = triplets[np.abs(side - model.distances_mm[2]) < parameters.tolerance_mm]
    if distinct_features:
        triplets = triplets[_distinct(points, triplets[:, 1], triplets[:, 2])]
    errors = distance_errors(points.position_mm[triplets], model)
    S = _error_covariance(points.position_mm[triplets], points.covariance_mm2[triplets])
    S += parameters.model_sd_mm**2 * np.eye(3)
    chi2 = np.einsum("ti,ti->t", errors, np.linalg.solve(S, errors[..., None])[..., 0])
    density = -0.5 * (chi2 + np.linalg.slogdet(2 * np.pi * S)[1])
    found = Triplets(triplets, np.linalg.norm(errors, axis=1), chi2, density)
    order = np.argsort(chi2, kind="stable")
    return found.take(order[chi2[order] <= parameters.chi2_limit])


def distance_errors(balls_mm: Float, model: TriadModel) -> Float:
    """Return measured minus model distances (..., 3) of balls (..., 3, 3); their norm is eq. 5.17."""
    lengths = [np.linalg.norm(balls_mm[..., a, :] - balls_mm[..., b, :], axis=-1) for a, b in _PAIRS]
    return np.stack(lengths, axis=-1) - model.distances_mm


def _error_covariance(balls_mm: Float, covariances_mm2: Float) -> Float:
    J = np.zeros((len(balls_mm), 3, 3, 3))  # triplet, distance, ball, axis
    for row, (a, b) in enumerate(_PAIRS):
        u = balls_mm[:, a] - balls_mm[:, b]
        u = u / np.linalg.norm(u, axis=1, keepdims=True)
        J[:, row, a], J[:, row, b] = u, -u
    JS = np.einsum("tdbi,tbij->tdbj", J, covariances_mm2).reshape(-1, 3, 9)
    return np.asarray(JS @ np.swapaxes(J.reshape(-1, 3, 9), -1, -2))


def _neighbours(points: Points, radius_mm: float, distinct: bool) -> Int:
    if len(points) < 3:
        return np.empty((0, 2), dtype=np.intp)
    pairs = cKDTree(points.position_mm).query_pairs(radius_mm, output_type="ndarray")
    if distinct:
        pairs = pairs[_distinct(points, pairs[:, 0], pairs[:, 1])]
    return np.concatenate([pairs, pairs[:, ::-1]])


def _distinct(points: Points, a: Int, b: Int) -> NDArray[np.bool_]:
    left, right = points.left_index, points.right_index
    return np.asarray((left[a] != left[b]) & (right[a] != right[b]))


def _join(first: Int, second: Int, n: int) -> Int:
    """Return all (a, b, c) with (a, b) in ``first`` and (a, c) in ``second``."""
    second = second[np.argsort(second[:, 0], kind="stable")]
    count = np.bincount(second[:, 0], minlength=n)
    start = np.cumsum(count) - count
    repeats = count[first[:, 0]]
    offset = np.arange(repeats.sum()) - np.repeat(np.cumsum(repeats) - repeats, repeats)
    c = second[np.repeat(start[first[:, 0]], repeats) + offset, 1]
    return np.column_stack([np.repeat(first, repeats, axis=0), c])
