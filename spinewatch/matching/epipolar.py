"""Epipolar candidates: pairs of a left and a right feature that may be images of the same ball."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Bool, Float, Int
from spinewatch.camera import Rig
from spinewatch.errors import ParameterError
from spinewatch.geometry.projection import Pinhole
from spinewatch.geometry.rays import Rays
from spinewatch.geometry.rotations import cross_matrix


@dataclass(frozen=True)
class EpipolarParameters:
    """Limits of the epipolar candidates.

    Attributes
    ----------
    range_mm
        Range of the markers (near, far) along each optical axis, mm; None to derive it from `range_fractions`.
    range_fractions
        (near, far) as fractions of the range at which the two optical axes come nearest to each other.
    end_margin
        Fraction of its length by which an epipolar segment is extended at both ends.
    tolerance_sigma
        Largest distance of a candidate from its epipolar line, in standard deviations of that distance.
    """

    range_mm: tuple[float, float] | None = None
    range_fractions: tuple[float, float] = (0.65, 1.2)
    end_margin: float = 0.02
    tolerance_sigma: float = 3.5


@dataclass(frozen=True, eq=False)
class CandidatePairs:
    """p pairs of features that are candidates of each other.

    Attributes
    ----------
    left
        Indices into the left features, shape (p,).
    right
        Indices into the right features, shape (p,).
    """

    left: Int
    right: Int


def candidate_pairs(left: Rays, right: Rays, rig: Rig, parameters: EpipolarParameters) -> CandidatePairs:
    """Return the mutual candidates of left and right features.

    Parameters
    ----------
    left, right
        Rays of the features of each image.
    rig
        The calibrated cameras.
    parameters
        Limits of the candidates.

    Returns
    -------
    CandidatePairs
        Pairs in order of the left index.

    Raises
    ------
    ParameterError
        If the range is not given and the optical axes do not meet in front of the cameras.

    References
    ----------
    Thesis section 5.3. Departures: a candidate must lie on the epipolar segment of the other feature in both
    directions, and the tolerance is in standard deviations, where the thesis has a number of pixels.
    """
    limits = range_limits_mm(rig, parameters)
    e, variance = _coplanarity(left, right)
    i, j = np.nonzero(e * e <= parameters.tolerance_sigma**2 * variance)
    margin, inside = parameters.end_margin, np.ones(len(i), dtype=bool)
    for rays, others, a, b, of_rays in ((left, right, i, j, limits[0]), (right, left, j, i, limits[1])):
        along, start = _segments(rays, others, of_rays)
        s = (along[a] * others.ideal_mm[b]).sum(axis=1) - start[a]
        inside &= (s >= -margin) & (s <= 1 + margin)
    return CandidatePairs(i[inside], j[inside])


def range_limits_mm(rig: Rig, parameters: EpipolarParameters) -> tuple[Float, Float]:
    """Return the range of the markers along both optical axes.

    Parameters
    ----------
    rig
        The calibrated cameras.
    parameters
        The range, or the fractions that define it.

    Returns
    -------
    left, right : Float
        (near, far) along the left and the right optical axis, shape (2,), mm.

    Raises
    ------
    ParameterError
        If the range is not given and the optical axes do not meet in front of the cameras.

    References
    ----------
    Thesis fig. 5.3, which derives the range from vergence, baseline and the range of the markers. Here the point at
    which the optical axes come nearest to each other replaces them.

    Examples
    --------
    >>> from spinewatch.simulation.rigs import large_rig
    >>> left, right = range_limits_mm(large_rig(), EpipolarParameters())
    >>> left.round()
    array([495., 914.])
    """
    if parameters.range_mm is not None:
        limits = np.array(parameters.range_mm)
        return limits, limits
    meet = rig.axes_approach_mm
    if meet is None or min(meet) <= 0:
        raise ParameterError(
            "the optical axes do not meet in front of the cameras; give the range of the markers"
        )
    left, right = (r * np.array(parameters.range_fractions) for r in meet)
    return left, right


def nominal_ranges_mm(rig: Rig, parameters: EpipolarParameters) -> tuple[float, float]:
    """Return the nominal range of the markers along both optical axes.

    Parameters
    ----------
    rig
        The calibrated cameras.
    parameters
        The range, or the fractions that define it.

    Returns
    -------
    tuple of float
        Middle of the range limits along the left and the right optical axis, mm.

    Raises
    ------
    ParameterError
        If the range is not given and the optical axes do not meet in front of the cameras.
    """
    left, right = range_limits_mm(rig, parameters)
    return float(left.mean()), float(right.mean())


def close_far_points(rays: Rays, limits_mm: Float) -> Float:
    """Return the points of rays at given ranges along the optical axis.

    Parameters
    ----------
    rays
        n rays of one camera.
    limits_mm
        Ranges, shape (k,), mm; (near, far) for the close and the far point.

    Returns
    -------
    Float
        Points, shape (n, k, 3), object space, mm.

    References
    ----------
    Thesis eqs 5.1 and 5.3.
    """
    scale = limits_mm / rays.pinhole.focal_length_mm
    return rays.pinhole.centre_mm + scale[:, None] * rays.vectors[:, None, :]


def epipolar_segments(rays: Rays, other: Pinhole, limits_mm: Float) -> Float:
    """Return the images of the close and the far points of rays in the other camera.

    Parameters
    ----------
    rays
        n rays of one camera.
    other
        Central projection of the other camera.
    limits_mm
        (near, far) along the optical axis of the rays' camera, shape (2,), mm.

    Returns
    -------
    Float
        Ends of the segments, shape (n, 2, 2), undistorted image plane, mm; NaN behind the camera.

    References
    ----------
    Thesis eqs 5.2 to 5.8. Departure: segments lie on the undistorted image plane, where epipolar lines are straight.
    """
    points = close_far_points(rays, limits_mm)
    ideal, _ = other.project(points)
    return np.where(other.in_front(points)[..., None], ideal, np.nan)


def within_segment(rays: Rays, others: Rays, limits_mm: Float, end_margin: float) -> Bool:
    """Return whether features lie between the ends of epipolar segments.

    Parameters
    ----------
    rays
        n rays of one camera.
    others
        m rays of the other camera.
    limits_mm
        (near, far) along the optical axis of the first camera, shape (2,), mm.
    end_margin
        Fraction of its length by which a segment is extended at both ends.

    Returns
    -------
    Bool
        Whether each of the others projects onto the segment of each ray, shape (n, m).
    """
    along, start = _segments(rays, others, limits_mm)
    s = along @ others.ideal_mm.T - start[:, None]
    return np.asarray((s >= -end_margin) & (s <= 1 + end_margin))


def epipolar_distance_sigma(left: Rays, right: Rays) -> Float:
    """Return the distances of features from epipolar lines in standard deviations.

    From the coplanarity of the two rays and the base, ``e = (B x a_L) . a_R``, divided by its standard deviation, to
    which the uncertainty of both features contributes. The result is the same in both images.

    Parameters
    ----------
    left
        n rays of the left camera.
    right
        m rays of the right camera.

    Returns
    -------
    Float
        Signed distances, shape (n, m), without unit.

    References
    ----------
    Thesis eq. 5.10, in pixels.
    """
    e, variance = _coplanarity(left, right)
    return np.asarray(e / np.sqrt(variance))


def epipolar_distance_mrad(
    left: Rays, right: Rays, rig: Rig, parameters: EpipolarParameters
) -> tuple[Float, Bool]:
    """Return the distances of right features from the epipolar lines of left ones, and which are in range.

    Parameters
    ----------
    left
        n rays of the left camera.
    right
        m rays of the right camera.
    rig
        The calibrated cameras.
    parameters
        Range of the markers and extension of the epipolar segments.

    Returns
    -------
    distance : Float
        Signed distances in the right image, shape (n, m), mrad.
    inside : Bool
        Whether each feature lies between the ends of the epipolar segment of the other, shape (n, m).

    Raises
    ------
    ParameterError
        If the range is not given and the optical axes do not meet in front of the cameras.

    References
    ----------
    Thesis eq. 5.10, in pixels.
    """
    limits = range_limits_mm(rig, parameters)
    inside = within_segment(left, right, limits[0], parameters.end_margin)
    inside &= within_segment(right, left, limits[1], parameters.end_margin).T
    normal = np.cross(right.pinhole.centre_mm - left.pinhole.centre_mm, left.vectors)
    size = np.linalg.norm(normal @ right.pinhole.M[:2].T, axis=1)
    return (normal @ right.vectors.T) / size[:, None] / right.pinhole.focal_length_mm * 1000, inside


def _segments(rays: Rays, others: Rays, limits_mm: Float) -> tuple[Float, Float]:
    """Return vectors (n, 2) whose product with an image point is its place on the segment plus a start (n,).

    The place is 0 at the close point and 1 at the far one.
    """
    segments = epipolar_segments(rays, others.pinhole, limits_mm)
    along = segments[:, 1] - segments[:, 0]
    along = along / (along * along).sum(axis=1, keepdims=True)
    return along, (along * segments[:, 0]).sum(axis=1)


def _coplanarity(left: Rays, right: Rays) -> tuple[Float, Float]:
    """Return the coplanarity of n left and m right rays, shape (n, m), and its variance."""
    across = cross_matrix(right.pinhole.centre_mm - left.pinhole.centre_mm)
    from_left, from_right = left.vectors @ across.T, right.vectors @ across
    e = from_left @ right.vectors.T
    in_right = _squares(from_left @ right.pinhole.M[:2].T) @ _entries(right.covariance_mm2).T
    in_left = _entries(left.covariance_mm2) @ _squares(from_right @ left.pinhole.M[:2].T).T
    return e, in_right + in_left


def _squares(g: Float) -> Float:
    """Return factors (n, 3) whose product with `_entries` of S is g^T S g, of gradients g (n, 2)."""
    return np.column_stack([g[:, 0] ** 2, 2 * g[:, 0] * g[:, 1], g[:, 1] ** 2])


def _entries(S: Float) -> Float:
    """Return the three different entries (n, 3) of covariances (n, 2, 2)."""
    return np.column_stack([S[:, 0, 0], S[:, 0, 1], S[:, 1, 1]])
