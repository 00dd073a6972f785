"""From the features of a stereo pair to measured triads: MATCH-POINT in one call."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from spinewatch.camera import Float, Rig
from spinewatch.correspondence.intersection import intersect, plate_projection
from spinewatch.correspondence.matcher import MatcherParameters, Points, match_features
from spinewatch.correspondence.rays import feature_rays
from spinewatch.features import Features
from spinewatch.flags import Flag
from spinewatch.triads.adjustment import adjust_poses
from spinewatch.triads.choose import ChooseParameters, SpineAxis, choose_triads
from spinewatch.triads.identify import IdentifyParameters, Int, Triplets, distance_errors, identify_triads
from spinewatch.triads.model import FLAT_10_14_18, TriadModel
from spinewatch.triads.pose import Ball, MeasuredTriad, absolute_orientation


@dataclass(frozen=True)
class SearchParameters:
    """Parameters of the whole search, one set a step.

    ``common_sd_mrad`` is the pointing error that the balls of a triad share in one view, 0.1 px on the cart:
    calibration, and light that comes from one side. Averaging over the balls does not lessen it.
    """

    matcher: MatcherParameters = field(default_factory=MatcherParameters)
    identify: IdentifyParameters = field(default_factory=IdentifyParameters)
    choose: ChooseParameters = field(default_factory=ChooseParameters)
    common_sd_mrad: float = 0.13


@dataclass(frozen=True, eq=False)
class TriadSearch:
    """The triads of a stereo pair in order along the spine axis, with what led to them."""

    triads: tuple[MeasuredTriad, ...]
    points: Points
    triplets: Triplets
    flags: tuple[Flag, ...]


def match_triads(
    left: Features,
    right: Features,
    rig: Rig,
    parameters: SearchParameters,
    *,
    expected: int | None = None,
    axis: SpineAxis = "auto",
    images: tuple[NDArray[np.generic], NDArray[np.generic]] | None = None,
    model: TriadModel = FLAT_10_14_18,
) -> TriadSearch:
    """Return the triads that the features of a stereo pair show, never more than ``expected``.

    Fewer are flagged "triad-count-low" (H5), never filled up by doubtful ones. ``images`` serve structural
    refinement only. Raises ``ParameterError`` when the range cannot be derived from the rig.
    """
    points = match_features(left, right, rig, parameters.matcher, images)
    triplets = identify_triads(points, model, parameters.identify)
    chosen = choose_triads(
        triplets, points, model, rig, parameters.identify, parameters.choose, expected=expected, axis=axis
    )
    balls = triplets.point[chosen]
    features = points.left_index[balls], points.right_index[balls]
    triads = measure_triads(left, right, rig, *features, model, common_sd_mrad=parameters.common_sd_mrad)
    return TriadSearch(triads, points, triplets, _count_flags(len(triads), expected))


def measure_triads(
    left: Features,
    right: Features,
    rig: Rig,
    left_index: Int,
    right_index: Int,
    model: TriadModel = FLAT_10_14_18,
    *,
    common_sd_mrad: float = 0.0,
) -> tuple[MeasuredTriad, ...]:
    """Return the triads whose balls are the given features (t, 3), in the model's order, of the two images.

    The poses are of greatest likelihood. Balls carry the features' covariance; a position's also has the error
    ``common_sd_mrad`` that all balls of a triad share in a view, which hardly turns it.
    Raises ``DegenerateTriadError`` when the balls of one lie on a line.
    """
    i, j = left_index.ravel(), right_index.ravel()
    views = feature_rays(rig.left, left).take(i), feature_rays(rig.right, right).take(j)
    found = intersect(views)
    centres = found.position_mm.reshape(-1, 3, 3)
    R, P = absolute_orientation(model.coordinates_mm, centres)
    poses, _ = adjust_poses(model, views, P, R)
    common = _common_covariance(rig, P, common_sd_mrad)
    errors = np.linalg.norm(distance_errors(centres, model), axis=-1)
    balls = [
        Ball(
            found.position_mm[k],
            found.covariance_mm2[k],
            left.xy_px[i[k]],
            right.xy_px[j[k]],
            float(found.parallax_mm[k]),
        )
        for k in range(len(i))
    ]
    return tuple(
        MeasuredTriad(
            model=model.name,
            balls=dict(zip(model.balls, balls[3 * t : 3 * t + 3], strict=True)),
            pose=replace(pose, covariance=pose.covariance + common[t]),
            error_mm=float(errors[t]),
        )
        for t, pose in enumerate(poses)
    )


def _common_covariance(rig: Rig, positions_mm: Float, sd_mrad: float) -> Float:
    """Return the (t, 6, 6) covariance of poses whose rays all point wrong by the same error in a view."""
    S = np.zeros((len(positions_mm), 6, 6))
    if sd_mrad > 0:
        N = np.zeros((len(positions_mm), 3, 3))
        for camera in (rig.left, rig.right):
            _, J = plate_projection(camera, positions_mm)
            N += np.swapaxes(J, -1, -2) @ J / (camera.focal_length_mm * sd_mrad / 1000) ** 2
        S[:, :3, :3] = np.linalg.inv(N)
    return S


def _count_flags(found: int, expected: int | None) -> tuple[Flag, ...]:
    if expected is None or found == expected:
        return ()
    detail = (
        f"{found} of {expected} triads were found; the others are hidden, or their balls were not detected"
    )
    return (Flag("triad-count-low", detail),)
