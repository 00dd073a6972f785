"""Candidate sets: which features of the other image may show the same ball (section 5.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Bool, Float
from spinewatch.camera import Rig
from spinewatch.errors import ParameterError
from spinewatch.geometry.projection import Pinhole
from spinewatch.geometry.rays import Rays


@dataclass(frozen=True)
class CandidateParameters:
    """Limits of a candidate.

    ``range_mm`` (near, far) along each camera's optical axis; None takes ``range_fractions`` of the range at
    which the two axes pass each other. ``sag`` lengthens the epipolar segment at both ends by a fraction of
    itself. ``tolerance_sigma`` bounds the distance from the epipolar line in standard deviations of that
    distance, where the thesis has a fixed number of pixels.
    """

    range_mm: tuple[float, float] | None = None
    range_fractions: tuple[float, float] = (0.65, 1.2)
    sag: float = 0.02
    tolerance_sigma: float = 3.5


@dataclass(frozen=True, eq=False)
class CandidatePairs:
    """Pairs of mutual candidates: indices (p,) into the ``left`` and the ``right`` features."""

    left: NDArray[np.intp]
    right: NDArray[np.intp]


def candidate_pairs(left: Rays, right: Rays, rig: Rig, parameters: CandidateParameters) -> CandidatePairs:
    """Return the mutual candidates of left and right features, in order of the left index.

    Raises ``ParameterError`` when the range cannot be derived from the rig.
    """
    limits = range_limits_mm(rig, parameters)
    near_line = np.abs(epipolar_distance_sigma(left, right)) <= parameters.tolerance_sigma
    forth = within_segment(left, right, limits[0], parameters.sag)
    back = within_segment(right, left, limits[1], parameters.sag).T
    accepted = near_line & forth & back
    i, j = np.nonzero(accepted)
    return CandidatePairs(i, j)


def range_limits_mm(rig: Rig, parameters: CandidateParameters) -> tuple[Float, Float]:
    """Return (near, far) along the left and the right optical axis, mm.

    The thesis derives them from vergence, baseline and the range of the markers (fig. 5.3); here the vergence
    tells where the rig was aimed. Raises ``ParameterError`` for axes that do not meet in front of the
    cameras.
    """
    if parameters.range_mm is not None:
        limits = np.array(parameters.range_mm)
        return limits, limits
    meet = rig.axes_approach_mm
    if meet is None or min(meet) <= 0:
        raise ParameterError(
            "the optical axes do not meet in front of the cameras: give the range of the markers"
        )
    left, right = (r * np.array(parameters.range_fractions) for r in meet)
    return left, right


def close_far_points(rays: Rays, limits_mm: Float) -> Float:
    """Return the points (n, 2, 3) of rays at the near and far range along the optical axis (eq. 5.1, 5.3)."""
    scale = limits_mm / rays.pinhole.focal_length_mm
    return rays.pinhole.centre_mm + scale[:, None] * rays.vectors[:, None, :]


def epipolar_segments(rays: Rays, other: Pinhole, limits_mm: Float) -> Float:
    """Return the epipolar segments (n, 2, 2) on the other camera's undistorted plate, mm (eq. 5.2 to 5.8)."""
    points = close_far_points(rays, limits_mm)
    ideal, _ = other.project(points)
    return np.where(other.in_front(points)[..., None], ideal, np.nan)


def within_segment(rays: Rays, others: Rays, limits_mm: Float, sag: float) -> Bool:
    """Return (n, m): whether the others lie between the ends of the rays' epipolar segments."""
    segments = epipolar_segments(rays, others.pinhole, limits_mm)
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    along = along / (along * along).sum(axis=1, keepdims=True)
    s = along @ others.ideal_mm.T - (along * start).sum(axis=1, keepdims=True)
    return np.asarray((s >= -sag) & (s <= 1 + sag))


def epipolar_distance_sigma(left: Rays, right: Rays) -> Float:
    """Return (n, m) signed distances from the epipolar lines in standard deviations, the same in both images.

    The perpendicular distance of eq. 5.10 divided by its standard deviation, to which the uncertainty of both
    features contributes. It comes from the coplanarity of the two rays and the base, e = (B x a_L) . a_R.
    """
    base = right.pinhole.centre_mm - left.pinhole.centre_mm
    from_left = np.cross(base, left.vectors)
    from_right = np.cross(right.vectors, base)
    e = from_left @ right.vectors.T
    in_right = _squares(from_left @ right.pinhole.M[:2].T) @ _entries(right.covariance_mm2).T
    in_left = _entries(left.covariance_mm2) @ _squares(from_right @ left.pinhole.M[:2].T).T
    return e / np.sqrt(in_right + in_left)


def _squares(g: Float) -> Float:
    """Return (n, 3) factors with which ``_entries`` of S gives g^T S g."""
    return np.column_stack([g[:, 0] ** 2, 2 * g[:, 0] * g[:, 1], g[:, 1] ** 2])


def _entries(S: Float) -> Float:
    return np.column_stack([S[:, 0, 0], S[:, 0, 1], S[:, 1, 1]])
