"""MATCH-POINT: from the features of two images to triads, as published (thesis chapter 5, appendix D)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from spinewatch.arrays import Float, Int, Pixels
from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.errors import ParameterError
from spinewatch.geometry.triangulation import Triangulation, triangulate
from spinewatch.markers import FLAT_10_14_18, TriadModel
from spinewatch.matching.selection_parameters import SpineAxis
from spinewatch.thesis_1995.candidate_sets import (
    CandidateSetParameters,
    CandidateSets,
    candidate_sets,
    refine_sets,
)
from spinewatch.thesis_1995.heuristics import PublishedSelection, TripletFeatures, published_selection


@dataclass(frozen=True)
class MatchPointParameters:
    """Parameters of `match_point`.

    Attributes
    ----------
    sets
        Candidate sets and their refinement.
    distance_tolerance_mm
        Largest difference of each distance from that of the marker, mm (eq. 5.16). The thesis gives no value; the
        errors of its tables, up to 5.65 mm, need at least 3.3 mm.
    model
        The marker, of the balls XX, YY and MX; P is on the line from MX to XX (fig. 5.6).

    Raises
    ------
    ParameterError
        If the marker has other balls.
    """

    sets: CandidateSetParameters = field(default_factory=CandidateSetParameters)
    distance_tolerance_mm: float = 3.5
    model: TriadModel = FLAT_10_14_18

    def __post_init__(self) -> None:
        if self.model.balls != ("XX", "YY", "MX"):
            raise ParameterError(
                f"the method of 1995 does not know the marker {self.model.name}; give one flat marker, or use the"
                " default method"
            )

    @property
    def leg_fraction(self) -> float:
        """Distance of P from MX as a fraction of that of XX from MX (fig. 5.7)."""
        xx, _, mx = np.linalg.norm(self.model.coordinates_mm, axis=1)
        return float(mx / (xx + mx))


@dataclass(frozen=True, eq=False)
class PublishedTriad:
    """A triad that passed all heuristics.

    Attributes
    ----------
    label
        Vertebra, by the order along the axis; None when the number of triads is not that of the labels.
    triplet
        Its index among the triplets.
    position_mm
        P, on the line from MX to XX, shape (3,), object space, mm.
    normal
        Unit normal of the plane of the balls, the direction of (XX - MX) x (XX - YY), shape (3,).
    """

    label: str | None
    triplet: int
    position_mm: Float
    normal: Float


@dataclass(frozen=True, eq=False)
class MatchPoint:
    """What MATCH-POINT computes from two feature lists, step by step.

    Attributes
    ----------
    sets
        Candidate sets by range and epipolar segment.
    refined
        Refined candidate sets; the same without refinement.
    correlation
        Correlation coefficients of the surroundings, shape (n, m); None without refinement.
    left, right
        Features of each reconstructed point, shape (k,).
    points
        Reconstructed points with their residuals (SPACO).
    triplets
        Points of XX, YY and MX of each triplet that fits the marker, shape (t, 3).
    features
        Features and distance errors of the triplets, as in Tables 5.4 to 5.6.
    selection
        Verdicts of the heuristics.
    triads
        Triads that passed, in order along the axis.
    """

    sets: CandidateSets
    refined: CandidateSets
    correlation: Float | None
    left: Int
    right: Int
    points: Triangulation
    triplets: Int
    features: tuple[TripletFeatures, ...]
    selection: PublishedSelection
    triads: tuple[PublishedTriad, ...]


def match_point(
    left: Features,
    right: Features,
    rig: Rig,
    labels: Sequence[str],
    parameters: MatchPointParameters,
    *,
    axis: SpineAxis = "x",
    images: tuple[Pixels, Pixels] | None = None,
) -> MatchPoint:
    """Return the triads that two feature lists show, by the published method.

    Parameters
    ----------
    left, right
        Features of the two images.
    rig
        The calibrated cameras.
    labels
        Vertebrae with a marker, in order of increasing coordinate along the axis; none leaves the triads without.
    parameters
        Parameters of the steps.
    axis
        Object-space axis along which the spine lies; "auto" for that of greatest extent.
    images
        Left and right gray image, shape (H, W), for the refinement, which is left out without them.

    Returns
    -------
    MatchPoint
        Triads with all that led to them.

    Raises
    ------
    ParameterError
        If the range is not given and the optical axes do not meet in front of the cameras.

    References
    ----------
    Thesis chapter 5. Pairs are reconstructed that are candidates from left to right or from right to left. H4 was not
    used in the thesis either.

    Examples
    --------
    >>> from spinewatch.simulation.rigs import large_rig
    >>> rig = large_rig()
    >>> balls = FLAT_10_14_18.coordinates_mm + [430.0, 390.0, 90.0]
    >>> left, right = (
    ...     Features.with_sigma(camera.project(balls), np.ones(3), 0.1) for camera in (rig.left, rig.right)
    ... )
    >>> triad = match_point(left, right, rig, ["T9"], MatchPointParameters()).triads[0]
    >>> triad.label, triad.position_mm.round(3), float(triad.normal[2].round(6))
    ('T9', array([430., 390.,  90.]), 1.0)
    """
    rays = left.rays(rig.left), right.rays(rig.right)
    sets = refined = candidate_sets(*rays, rig, parameters.sets)
    correlation = None
    if images is not None and parameters.sets.refine:
        refined, correlation = refine_sets(sets, (left, right), images, parameters.sets)
    i, j = np.nonzero(refined.pairs)
    points = triangulate([rays[0].take(i), rays[1].take(j)])
    triplets, error_mm = fitting_triplets(
        points.position_mm, parameters.model, parameters.distance_tolerance_mm
    )
    features = tuple(
        TripletFeatures(float(error), tuple((int(i[p]), int(j[p])) for p in triplet))  # type: ignore[arg-type]
        for triplet, error in zip(triplets, error_mm, strict=True)
    )
    selection = published_selection(features, len(labels))
    triads = _triads(points.position_mm, triplets, selection, labels, axis, parameters.leg_fraction)
    return MatchPoint(sets, refined, correlation, i, j, points, triplets, features, selection, triads)


def fitting_triplets(points_mm: Float, model: TriadModel, tolerance_mm: float) -> tuple[Int, Float]:
    """Return the triplets of points whose distances fit a marker.

    Parameters
    ----------
    points_mm
        Points, shape (k, 3), mm.
    model
        Marker of three balls.
    tolerance_mm
        Largest difference of each distance from that of the marker, mm.

    Returns
    -------
    triplets : Int
        Points in the order of the balls of the marker, shape (t, 3). Of the permutations of three points that fit, the
        one of the smallest error.
    error_mm : Float
        Errors of the distance matrices, shape (t,), mm.

    References
    ----------
    Thesis eqs 5.16 and 5.17, Table 5.3.

    Examples
    --------
    >>> points = np.array([[-10.0, 0.0, 0.0], [0.0, -14.0, 0.0], [18.0, 0.0, 0.0], [90.0, 0.0, 0.0]])
    >>> triplets, error_mm = fitting_triplets(points, FLAT_10_14_18, 3.5)
    >>> triplets, error_mm.round(6)
    (array([[2, 1, 0]]), array([0.]))
    """
    distance = np.linalg.norm(points_mm[:, None] - points_mm[None], axis=2)
    np.fill_diagonal(distance, np.inf)
    xy, xm, ym = (distance - d for d in model.distances_mm)
    fits = [np.abs(d) < tolerance_mm for d in (xy, xm, ym)]
    found = [
        (int(x), int(y), int(m))
        for x, y in np.argwhere(fits[0])
        for m in np.flatnonzero(fits[1][x] & fits[2][y])
    ]
    if not found:
        return np.empty((0, 3), dtype=np.intp), np.empty(0)
    ordered = np.array(found, dtype=np.intp)
    x, y, m = ordered.T
    error = np.sqrt(xy[x, y] ** 2 + xm[x, m] ** 2 + ym[y, m] ** 2)
    best: dict[tuple[int, ...], int] = {}
    for index in np.argsort(error, kind="stable"):
        best.setdefault(tuple(sorted(found[index])), int(index))
    kept = sorted(best.values())
    return ordered[kept], error[kept]


def _triads(
    points_mm: Float,
    triplets: Int,
    selection: PublishedSelection,
    labels: Sequence[str],
    axis: SpineAxis,
    leg_fraction: float,
) -> tuple[PublishedTriad, ...]:
    """Return the triads that passed, labelled by their order along an axis when all were found (H5)."""
    passed = [k for k, verdict in enumerate(selection.verdicts) if verdict == "P"]
    xx, yy, mx = (points_mm[triplets[passed, ball]] for ball in range(3))
    position = mx + leg_fraction * (xx - mx)
    normal = np.cross(xx - mx, xx - yy)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    extent = np.ptp(position[:, :2], axis=0) if passed else np.zeros(2)
    along = int(np.argmax(extent)) if axis == "auto" else "xy".index(axis)
    order = np.argsort(position[:, along], kind="stable")
    names = list(labels) if selection.complete else [None] * len(passed)
    return tuple(
        PublishedTriad(name, passed[k], position[k], normal[k]) for name, k in zip(names, order, strict=True)
    )
