"""Candidate sets of MATCH-POINT and their refinement by rules (thesis sections 5.3 and 5.4)."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from spinewatch.arrays import Bool, Float, Pixels
from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.geometry.rays import Rays
from spinewatch.matching.epipolar import (
    EpipolarParameters,
    epipolar_segments,
    range_limits_mm,
    within_segment,
)


@dataclass(frozen=True)
class CandidateSetParameters:
    """Parameters of `candidate_sets` and `refine_sets`.

    Attributes
    ----------
    epipolar
        Range of the markers; its tolerance is not used.
    tolerance_mm
        Largest perpendicular distance from the epipolar segment, image plane, mm (eq. 5.9). The thesis gives no value;
        0.03 mm are three pixels of its cameras.
    refine
        Whether candidate sets are refined.
    window_px
        Side of the windows that are correlated, px.
    similarity_ratio
        Fraction of the greatest correlation of a set that a candidate must exceed (eq. 5.11). The thesis took 0.5 for
        its tests and 0.8 where speed mattered, with a small vergence.
    """

    epipolar: EpipolarParameters = field(default_factory=lambda: EpipolarParameters(end_margin=0.0))
    tolerance_mm: float = 0.03
    refine: bool = True
    window_px: int = 75
    similarity_ratio: float = 0.5


@dataclass(frozen=True, eq=False)
class CandidateSets:
    """The candidates of each feature in the other image.

    Attributes
    ----------
    of_left
        Whether each right feature is a candidate of each left feature, shape (n, m).
    of_right
        Whether each left feature is a candidate of each right feature, shape (n, m).
    """

    of_left: Bool
    of_right: Bool

    @property
    def pairs(self) -> Bool:
        """Pairs that are reconstructed, shape (n, m): candidates in at least one direction."""
        return self.of_left | self.of_right


def candidate_sets(left: Rays, right: Rays, rig: Rig, parameters: CandidateSetParameters) -> CandidateSets:
    """Return the features near each other's epipolar segments.

    Parameters
    ----------
    left
        Rays of the n left features.
    right
        Rays of the m right features.
    rig
        The calibrated cameras.
    parameters
        Range and tolerance.

    Returns
    -------
    CandidateSets
        Candidate sets of both registrations, left to right and right to left.

    Raises
    ------
    ParameterError
        If the range is not given and the optical axes do not meet in front of the cameras.

    References
    ----------
    Thesis eqs 5.1 to 5.10.

    Examples
    --------
    >>> from spinewatch.simulation.rigs import large_rig
    >>> rig, balls = large_rig(), np.array([[430.0, 390.0, 90.0], [460.0, 450.0, 95.0]])
    >>> left, right = (camera.rays(camera.project(balls), np.eye(2)) for camera in (rig.left, rig.right))
    >>> candidate_sets(left, right, rig, CandidateSetParameters()).of_left
    array([[ True, False],
           [False,  True]])
    """
    limits = range_limits_mm(rig, parameters.epipolar)
    of_left, of_right = (
        _near_segments(rays, others, limit, parameters)
        for rays, others, limit in ((left, right, limits[0]), (right, left, limits[1]))
    )
    return CandidateSets(of_left, of_right.T)


def refine_sets(
    sets: CandidateSets,
    features: tuple[Features, Features],
    images: tuple[Pixels, Pixels],
    parameters: CandidateSetParameters,
) -> tuple[CandidateSets, Float]:
    """Return the candidates whose surroundings are similar to those of the feature.

    Parameters
    ----------
    sets
        Candidate sets.
    features
        Left and right features.
    images
        Left and right gray image, shape (H, W).
    parameters
        Size of the windows and the fraction of the greatest correlation.

    Returns
    -------
    sets : CandidateSets
        Refined candidate sets.
    correlation : Float
        Correlation coefficients of the windows of all pairs, shape (n, m).

    References
    ----------
    Thesis eqs 4.14 and 5.11, Tables 5.1 and 5.2.
    """
    left, right = (
        feature_windows(image, side.xy_px, parameters.window_px)
        for image, side in zip(images, features, strict=True)
    )
    rho = left @ right.T
    refined = replace(
        sets,
        of_left=sets.of_left & near_greatest(rho, sets.of_left, 1, parameters.similarity_ratio),
        of_right=sets.of_right & near_greatest(rho, sets.of_right, 0, parameters.similarity_ratio),
    )
    return refined, rho


def feature_windows(image: Pixels, xy_px: Float, window_px: int) -> Float:
    """Return the windows about features, of zero mean and unit norm.

    Parameters
    ----------
    image
        Gray image, shape (H, W); its border is repeated beyond it.
    xy_px
        Features (u, v), shape (n, 2), px.
    window_px
        Side of a window, an odd number of pixels.

    Returns
    -------
    Float
        Windows, shape (n, window_px^2); zero where the image is flat.

    Examples
    --------
    >>> image = np.arange(100, dtype=np.uint8).reshape(10, 10)
    >>> windows = feature_windows(image, np.array([[4.0, 4.0], [6.0, 5.0]]), 3)
    >>> float((windows @ windows.T)[0, 1].round(6))
    1.0
    """
    half = window_px // 2
    padded = np.pad(np.asarray(image, dtype=np.float64), half, mode="edge")
    height, width = image.shape
    centre = np.clip(np.rint(xy_px).astype(int), 0, [width - 1, height - 1])
    windows = np.lib.stride_tricks.sliding_window_view(padded, (window_px, window_px))
    found = windows[centre[:, 1], centre[:, 0]].reshape(len(xy_px), -1)
    found = found - found.mean(axis=1, keepdims=True)
    norm = np.linalg.norm(found, axis=1, keepdims=True)
    return np.where(norm > 1e-9, found / np.maximum(norm, 1e-9), 0.0)


def _near_segments(rays: Rays, others: Rays, limits_mm: Float, parameters: CandidateSetParameters) -> Bool:
    """Return whether each of the others (m) is near the epipolar segment of each ray (n), shape (n, m)."""
    segments = epipolar_segments(rays, others.pinhole, limits_mm)
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    normal = np.column_stack([-along[:, 1], along[:, 0]]) / np.linalg.norm(along, axis=1, keepdims=True)
    distance_mm = normal @ others.ideal_mm.T - (normal * start).sum(axis=1, keepdims=True)
    inside = within_segment(rays, others, limits_mm, parameters.epipolar.end_margin)
    return np.asarray((np.abs(distance_mm) <= parameters.tolerance_mm) & inside)


def near_greatest(rho: Float, member: Bool, axis: int, ratio: float) -> Bool:
    """Return whether similarities exceed a fraction of the greatest one of their set.

    Parameters
    ----------
    rho
        Similarities of pairs, shape (n, m).
    member
        Whether a pair is in a candidate set, shape (n, m).
    axis
        Axis along which the members of a set lie.
    ratio
        Fraction of the greatest similarity.

    Returns
    -------
    Bool
        Whether each pair remains, shape (n, m).

    References
    ----------
    Thesis eq. 5.11.
    """
    greatest = np.where(member, rho, -np.inf).max(axis=axis, keepdims=True, initial=-np.inf)
    return np.asarray((rho > ratio * greatest) | (rho >= greatest))
