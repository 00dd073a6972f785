"""Identification of markers: tuples of points whose mutual distances are those of a marker."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import chdtri, gammaln

from spinewatch.arrays import Bool, Float, Int
from spinewatch.markers import TriadModel
from spinewatch.matching.points import Points


@dataclass(frozen=True)
class IdentificationParameters:
    """Limits of the distance errors of a triad.

    Attributes
    ----------
    tolerance_mm
        Largest error of each distance, tau of eq. 5.16, mm.
    significance
        Probability that the chi-square test of the distance errors discards a true triad; 0 for no test.
    model_sd_mm
        Standard deviation of each distance of a marker as manufactured, mm.
    """

    tolerance_mm: float = 5.0
    significance: float = 0.001
    model_sd_mm: float = 0.2


@dataclass(frozen=True, eq=False)
class Triplets:
    """t tuples of points that may be a marker of n balls: triplets, or quadruplets for one of four balls.

    Attributes
    ----------
    point
        Indices of points in the order of the model's balls, shape (t, n).
    error_mm
        Errors of the distance matrix (eq. 5.17), shape (t,), mm.
    distance_chi2
        Chi-squares of the distance errors, shape (t,), 3 n - 6 degrees of freedom.
    log_odds
        Logarithms of the ratio of the likelihood of the distance errors for a true triad to that for a chance tuple
        within the limits, shape (t,).
    """

    point: Int
    error_mm: Float
    distance_chi2: Float
    log_odds: Float

    def __len__(self) -> int:
        return len(self.point)

    def take(self, index: object) -> Triplets:
        """Return a selection of the tuples.

        Parameters
        ----------
        index
            Index or mask array.

        Returns
        -------
        Triplets
            The selected tuples, in the order of the index.
        """
        i = np.asarray(index)
        return Triplets(*(getattr(self, f.name)[i] for f in fields(self)))


def identify_triads(
    points: Points, model: TriadModel, parameters: IdentificationParameters, *, distinct_features: bool = True
) -> Triplets:
    """Return every ordered tuple of points whose distances are those of a marker.

    Parameters
    ----------
    points
        Triangulated points.
    model
        The marker.
    parameters
        Limits of the distance errors.
    distinct_features
        Whether the balls must have different features in both images: heuristic H1, applied during the search.

    Returns
    -------
    Triplets
        Tuples by increasing chi-square; a set of points appears once for each of its orders that fits.

    References
    ----------
    Thesis section 5.6, eqs 5.16 and 5.17. Departures: the distance errors must also fit their covariance, and markers
    may have four balls, of which mirror images are discarded.

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.markers import FLAT_10_14_18 as model
    >>> n, index = 3, np.arange(3)
    >>> covariance = np.tile(0.1**2 * np.eye(3), (n, 1, 1))
    >>> nothing = np.zeros(n)
    >>> points = Points(model.coordinates_mm + 100, covariance, index, index, nothing, nothing, nothing, nothing)
    >>> identify_triads(points, model, IdentificationParameters()).point
    array([[0, 1, 2]])
    """
    limit = chi2_limit(_dof(model), parameters.significance)
    tuples = _fitting_tuples(points, model, parameters, distinct_features, limit)
    tuples = tuples[model.matches_chirality(points.position_mm[tuples])]
    found = _rate_tuples(tuples, points, model, parameters)
    order = np.argsort(found.distance_chi2, kind="stable")
    return found.take(order[found.distance_chi2[order] <= limit])


@dataclass(frozen=True, eq=False)
class DiscardedTuples:
    """t tuples of points whose distances are near those of a marker, and which `identify_triads` discards.

    Attributes
    ----------
    point
        Indices of points in the order of the model's balls, shape (t, n).
    error_mm
        Errors of the distance matrix (eq. 5.17), shape (t,), mm.
    distinct
        Whether their balls have different features in both images (heuristic H1), shape (t,).
    same_handed
        Whether they are not the mirror image of the marker, shape (t,).
    """

    point: Int
    error_mm: Float
    distinct: Bool
    same_handed: Bool


def discarded_tuples(
    points: Points, model: TriadModel, parameters: IdentificationParameters
) -> DiscardedTuples:
    """Return the tuples within the tolerance of each distance that `identify_triads` discards.

    Parameters
    ----------
    points
        Triangulated points.
    model
        The marker.
    parameters
        Limits of the distance errors.

    Returns
    -------
    DiscardedTuples
        Tuples by increasing error. Those that are distinct and same-handed failed the chi-square test.
    """
    tuples = _fitting_tuples(points, model, parameters, distinct=False)
    rated = _rate_tuples(tuples, points, model, parameters)
    distinct = np.ones(len(tuples), dtype=bool)
    for a, b in model.pairs:
        distinct &= _distinct(points, tuples[:, a], tuples[:, b])
    same_handed = np.asarray(model.matches_chirality(points.position_mm[tuples]))
    limit = chi2_limit(_dof(model), parameters.significance)
    kept = distinct & same_handed & (rated.distance_chi2 <= limit)
    order = np.argsort(rated.error_mm, kind="stable")
    order = order[~kept[order]]
    return DiscardedTuples(tuples[order], rated.error_mm[order], distinct[order], same_handed[order])


def distance_errors(balls_mm: Float, model: TriadModel) -> Float:
    """Return measured minus model distances.

    Parameters
    ----------
    balls_mm
        Balls in the order of the model, shape (..., n, 3), mm.
    model
        The marker.

    Returns
    -------
    Float
        Errors of the distances between the ball pairs, shape (..., d), mm; their norm is the error of eq. 5.17.
    """
    a, b = (balls_mm[..., k, :] for k in model.pairs.T)
    return np.asarray(np.linalg.norm(a - b, axis=-1) - model.distances_mm)


def pairs_at_distances(
    points: Points, distances_mm: Float, tolerance_mm: float, distinct_features: bool = True
) -> list[Int]:
    """Return the pairs of points at given distances from each other.

    Parameters
    ----------
    points
        Triangulated points.
    distances_mm
        Distances, shape (d,), mm.
    tolerance_mm
        Largest deviation from a distance, mm.
    distinct_features
        Whether the points of a pair must have different features in both images.

    Returns
    -------
    list of Int
        Ordered pairs of indices for each distance, shape (p, 2); every pair appears in both orders.
    """
    pairs = _neighbours(points, float(distances_mm.max()) + tolerance_mm, distinct_features)
    length = np.linalg.norm(points.position_mm[pairs[:, 0]] - points.position_mm[pairs[:, 1]], axis=1)
    return [pairs[np.abs(length - d) < tolerance_mm] for d in distances_mm]


def distance_chi2(points: Points, pairs: Int, distance_mm: float, model_sd_mm: float) -> Float:
    """Return the chi-squares of the distances of pairs of points.

    Parameters
    ----------
    points
        Triangulated points.
    pairs
        Pairs of indices, shape (p, 2).
    distance_mm
        Distance on the marker, mm.
    model_sd_mm
        Standard deviation of that distance as manufactured, mm.

    Returns
    -------
    Float
        Chi-squares, shape (p,), one degree of freedom.
    """
    i, j = pairs.T
    along = points.position_mm[j] - points.position_mm[i]
    length = np.sqrt((along * along).sum(axis=1))
    u = along / length[:, None]
    S = points.covariance_mm2[i] + points.covariance_mm2[j]
    variance = (u * (S @ u[..., None])[..., 0]).sum(axis=1) + model_sd_mm**2
    return np.asarray((length - distance_mm) ** 2 / variance)


def log_gate_volume(dof: int, significance: float) -> float:
    """Return the logarithm of the volume of whitened errors that pass a chi-square test.

    Parameters
    ----------
    dof
        Degrees of freedom.
    significance
        Probability that the test discards a true value.

    Returns
    -------
    float
        Log volume of a ball in ``dof`` dimensions, without unit.
    """
    radius2 = chi2_limit(dof, significance)
    return float(0.5 * dof * np.log(np.pi * radius2) - gammaln(dof / 2 + 1))


def chi2_limit(dof: int, significance: float) -> float:
    """Return the chi-square that a true value exceeds with a given probability.

    Parameters
    ----------
    dof
        Degrees of freedom.
    significance
        The probability; 0 for an infinite limit.

    Returns
    -------
    float
        Limit of a chi-square test.

    Examples
    --------
    >>> round(chi2_limit(3, 0.001), 3)
    16.266
    """
    return float(chdtri(dof, significance))


def _dof(model: TriadModel) -> int:
    """Return the degrees of freedom of the distances between n balls."""
    return 3 * len(model.balls) - 6


def _fitting_tuples(
    points: Points,
    model: TriadModel,
    parameters: IdentificationParameters,
    distinct: bool,
    max_chi2: float = np.inf,
) -> Int:
    """Return the tuples (t, n) whose distances are within the tolerance, ball by ball.

    The chi-square of a tuple is no smaller than that of one of its distances: pairs beyond the largest one are not
    joined.
    """
    lists = pairs_at_distances(points, model.distances_mm, parameters.tolerance_mm, distinct)
    if max_chi2 < np.inf:
        lists = [
            pairs[distance_chi2(points, pairs, distance, parameters.model_sd_mm) <= max_chi2]
            for pairs, distance in zip(lists, model.distances_mm, strict=True)
        ]
    of_pair = {tuple(pair): i for i, pair in enumerate(model.pairs.tolist())}
    tuples = lists[of_pair[0, 1]]
    for ball in range(2, len(model.balls)):
        tuples = _join(tuples, lists[of_pair[0, ball]], len(points))
        for other in range(1, ball):
            a, b = tuples[:, other], tuples[:, ball]
            length = np.linalg.norm(points.position_mm[a] - points.position_mm[b], axis=1)
            model_length = model.distances_mm[of_pair[other, ball]]
            fits = np.abs(length - model_length) < parameters.tolerance_mm
            tuples = tuples[fits & _distinct(points, a, b) if distinct else fits]
    return tuples


def _rate_tuples(
    tuples: Int, points: Points, model: TriadModel, parameters: IdentificationParameters
) -> Triplets:
    """Return tuples (t, n) with the chi-squares and log-odds of their distance errors."""
    balls = points.position_mm[tuples]
    errors = distance_errors(balls, model)
    S = _error_covariance(balls, points.covariance_mm2[tuples], model.pairs)
    S += parameters.model_sd_mm**2 * np.eye(len(model.pairs))
    chi_square = np.einsum("td,td->t", errors, np.linalg.solve(S, errors[..., None])[..., 0])
    k = len(model.pairs)
    half_log_det = 0.5 * np.linalg.slogdet(S)[1]
    log_density = -0.5 * chi_square - half_log_det - 0.5 * k * np.log(2 * np.pi)
    log_gate = half_log_det + log_gate_volume(_dof(model), parameters.significance)
    log_chance_density = -np.minimum(log_gate, k * np.log(2 * parameters.tolerance_mm))
    return Triplets(tuples, np.linalg.norm(errors, axis=1), chi_square, log_density - log_chance_density)


def _error_covariance(balls_mm: Float, covariances_mm2: Float, pairs: Int) -> Float:
    """Return the covariances (t, d, d) of the distances between balls (t, n, 3)."""
    t, n = balls_mm.shape[:2]
    J = np.zeros((t, len(pairs), n, 3))
    for row, (a, b) in enumerate(pairs):
        u = balls_mm[:, a] - balls_mm[:, b]
        u = u / np.linalg.norm(u, axis=1, keepdims=True)
        J[:, row, a], J[:, row, b] = u, -u
    JS = np.einsum("tdbi,tbij->tdbj", J, covariances_mm2).reshape(t, len(pairs), 3 * n)
    return np.asarray(JS @ np.swapaxes(J.reshape(t, len(pairs), 3 * n), -1, -2))


def _neighbours(points: Points, radius_mm: float, distinct: bool) -> Int:
    """Return the ordered pairs (p, 2) of points within a radius of each other."""
    if len(points) < 2:
        return np.empty((0, 2), dtype=np.intp)
    pairs = cKDTree(points.position_mm).query_pairs(radius_mm, output_type="ndarray")
    if distinct:
        pairs = pairs[_distinct(points, pairs[:, 0], pairs[:, 1])]
    return np.concatenate([pairs, pairs[:, ::-1]])


def _distinct(points: Points, a: Int, b: Int) -> Bool:
    """Return whether points (p,) and points (p,) have different features in both images."""
    left, right = points.left_index, points.right_index
    return np.asarray((left[a] != left[b]) & (right[a] != right[b]))


def _join(tuples: Int, second: Int, n: int) -> Int:
    """Return all (a, ..., c) with (a, ...) in ``tuples`` and (a, c) in ``second``, of n points."""
    second = second[np.argsort(second[:, 0], kind="stable")]
    count = np.bincount(second[:, 0], minlength=n)
    start = np.cumsum(count) - count
    repeats = count[tuples[:, 0]]
    offset = np.arange(repeats.sum()) - np.repeat(np.cumsum(repeats) - repeats, repeats)
    c = second[np.repeat(start[tuples[:, 0]], repeats) + offset, 1]
    return np.column_stack([np.repeat(tuples, repeats, axis=0), c])
