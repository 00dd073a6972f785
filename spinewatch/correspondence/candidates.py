"""Candidate sets: which features of the other image may show the same ball (section 5.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinewatch.camera import Camera, Float, Rig
from spinewatch.correspondence.rays import Rays
from spinewatch.errors import ParameterError

Bool = NDArray[np.bool_]


@dataclass(frozen=True)
class CandidateParameters:
    """Limits of a candidate.

    ``range_mm`` (near, far) along each camera's optical axis; None takes ``range_fractions`` of the range at
    which the two axes pass each other. ``sag`` lengthens the epipolar segment at both ends by a fraction of
    itself. ``tolerance_sigma`` bounds the distance from the epipolar line in standard deviations of that
    distance, where the thesis has a fixed number of pixels. ``y_disparity_px`` (least, most) of v_right -
    v_left is optional.
    """

    range_mm: tuple[float, float] | None = None
    range_fractions: tuple[float, float] = (0.65, 1.2)
    sag: float = 0.02
    tolerance_sigma: float = 3.5
    y_disparity_px: tuple[float, float] | None = None


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
    if parameters.y_disparity_px is not None:
        accepted &= _within_disparity(left, right, parameters.y_disparity_px)
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
    axes = -np.stack([rig.left.M[2], rig.right.M[2]], axis=1)
    A = np.column_stack([axes[:, 0], -axes[:, 1]])
    meet, _, rank, _ = np.linalg.lstsq(A, rig.right.centre - rig.left.centre, rcond=1e-6)
    if rank < 2 or np.any(meet <= 0):
        raise ParameterError(
            "the optical axes do not meet in front of the cameras: give the range of the markers"
        )
    left, right = (float(r) * np.array(parameters.range_fractions) for r in meet)
    return left, right


def close_far_points(rays: Rays, limits_mm: Float) -> Float:
    """Return the points (n, 2, 3) of rays at the near and far range along the optical axis (eq. 5.1, 5.3)."""
    camera = rays.camera
    scale = limits_mm / camera.focal_length_mm
    return camera.centre + scale[:, None] * rays.vectors[:, None, :]


def epipolar_segments(rays: Rays, other: Camera, limits_mm: Float) -> Float:
    """Return the epipolar segments (n, 2, 2) on the other camera's undistorted plate, mm (eq. 5.2 to 5.8)."""
    Xc = (close_far_points(rays, limits_mm) - other.centre) @ other.M.T
    depth = np.where(Xc[..., 2] < 0, Xc[..., 2], np.nan)
    return -other.focal_length_mm * Xc[..., :2] / depth[..., None]


def within_segment(rays: Rays, others: Rays, limits_mm: Float, sag: float) -> Bool:
    """Return (n, m): whether the others lie between the ends of the rays' epipolar segments."""
    segments = epipolar_segments(rays, others.camera, limits_mm)
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    along = along / (along * along).sum(axis=1, keepdims=True)
    s = along @ others.ideal_mm.T - (along * start).sum(axis=1, keepdims=True)
    return np.asarray((s >= -sag) & (s <= 1 + sag))


def epipolar_distance_sigma(left: Rays, right: Rays) -> Float:
    """Return (n, m) signed distances from the epipolar lines in standard deviations, the same in both images.

    The perpendicular distance of eq. 5.10 divided by its standard deviation, to which the uncertainty of both
    features contributes. It comes from the coplanarity of the two rays and the base, e = (B x a_L) . a_R.
    """
    base = right.camera.centre - left.camera.centre
    from_left = np.cross(base, left.vectors)
    from_right = np.cross(right.vectors, base)
    e = from_left @ right.vectors.T
    in_right = _squares(from_left @ right.camera.M[:2].T) @ _entries(right.covariance_mm2).T
    in_left = _entries(left.covariance_mm2) @ _squares(from_right @ left.camera.M[:2].T).T
    return e / np.sqrt(in_right + in_left)


def _squares(g: Float) -> Float:
    """Return (n, 3) factors with which ``_entries`` of S gives g^T S g."""
    return np.column_stack([g[:, 0] ** 2, 2 * g[:, 0] * g[:, 1], g[:, 1] ** 2])


def _entries(S: Float) -> Float:
    return np.column_stack([S[:, 0, 0], S[:, 0, 1], S[:, 1, 1]])


def _within_disparity(left: Rays, right: Rays, limits_px: tuple[float, float]) -> Bool:
    v_left, v_right = (_rows(rays) for rays in (left, right))
    disparity = v_right - v_left[:, None]
    return (disparity >= limits_px[0]) & (disparity <= limits_px[1])


def _rows(rays: Rays) -> Float:
    return rays.camera.pixels(rays.camera.distort(rays.ideal_mm))[:, 1]
