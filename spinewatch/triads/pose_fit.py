"""Measured triads of selected candidates: balls and maximum-likelihood poses with covariances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from spinewatch.arrays import Bool, Float, Int
from spinewatch.camera import Rig
from spinewatch.detection.features import HIDDEN, Features
from spinewatch.geometry.rays import Rays
from spinewatch.geometry.rotations import cross_matrix
from spinewatch.geometry.triangulation import Triangulation, triangulate
from spinewatch.imaging.frame import SIDES, Side
from spinewatch.markers import TriadModel
from spinewatch.matching.triad_candidates import TriadCandidates
from spinewatch.triads.pose import Ball, MeasuredTriad, Pose
from spinewatch.triads.pose_adjustment import (
    PoseAdjustment,
    PoseAdjustmentParameters,
    TriadImages,
    adjust_poses,
    triad_images,
)
from spinewatch.triads.twist import TiltPrior, TwistParameters, average_over_twist

NO_POSE = "the visible balls do not determine the pose"


@dataclass(frozen=True)
class PoseParameters:
    """Error model and limits of poses.

    Attributes
    ----------
    common_sd_mrad
        Standard deviation per axis of the pointing error that the balls of a triad share in an image, mrad (0.12 is
        0.09 px on the cart): calibration, and light from one side. Averaging over the balls does not reduce it.
    tilt_sd_deg
        Prior standard deviation per axis of the tilt of a triad with a hidden ball, degrees.
    max_rotation_sd_deg
        Largest standard deviation of a rotation, degrees; a triad with a hidden ball whose rotation is less certain has
        no pose.
    adjustment
        Adjustment of poses.
    twist
        Mean over the twist of triads of which both images show two balls.
    """

    common_sd_mrad: float = 0.12
    tilt_sd_deg: float = 18.0
    max_rotation_sd_deg: float = 15.0
    adjustment: PoseAdjustmentParameters = field(default_factory=PoseAdjustmentParameters)
    twist: TwistParameters = field(default_factory=TwistParameters)


@dataclass(frozen=True, eq=False)
class _BallImages:
    """Images (2,) of a ball, px, None where hidden; and the images in which a person placed its centre."""

    left_px: Float | None
    right_px: Float | None
    manual_in: tuple[Side, ...]


def fit_poses(
    left: Features,
    right: Features,
    rig: Rig,
    candidates: TriadCandidates,
    models: Sequence[TriadModel],
    parameters: PoseParameters | None = None,
) -> tuple[MeasuredTriad, ...]:
    """Return the measured triads of selected candidates.

    Parameters
    ----------
    left, right
        Features of the two images, with the covariances of their own errors.
    rig
        The calibrated cameras.
    candidates
        Features of each triad, with an approximate pose.
    models
        The markers.
    parameters
        Error model and limits; the default ones if None.

    Returns
    -------
    tuple of MeasuredTriad
        The triads in the order of the candidates. The pose is None if the visible balls do not determine it.

    References
    ----------
    Replaces the position and normal of thesis section 5.7, fig. 5.7.

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.markers import FLAT_10_14_18 as model
    >>> from spinewatch.simulation.rigs import large_rig
    >>> rig, origin = large_rig(), np.array([[430.0, 390.0, 90.0]])
    >>> left, right = (
    ...     Features.with_sigma(camera.project(origin + model.coordinates_mm), np.ones(3), 0.1)
    ...     for camera in (rig.left, rig.right)
    ... )
    >>> index = np.array([[0, 1, 2, HIDDEN]])
    >>> one = TriadCandidates(np.zeros(1, dtype=int), origin + 1, np.eye(3)[None], np.zeros(1), index, index)
    >>> (triad,) = fit_poses(left, right, rig, one, [model])
    >>> triad.pose.position_mm.round(6)
    array([430., 390.,  90.])
    """
    parameters = parameters or PoseParameters()
    rays = left.rays(rig.left), right.rays(rig.right)
    triads: dict[int, MeasuredTriad] = {}
    for index, model in enumerate(models):
        members = np.flatnonzero(candidates.model == index)
        if len(members):
            part = _fit_one_model((left, right), rays, candidates.take(members), model, parameters)
            triads.update(zip(members.tolist(), part, strict=True))
    return tuple(triads[i] for i in range(len(candidates)))


def _fit_one_model(
    features: tuple[Features, Features],
    rays: tuple[Rays, Rays],
    candidates: TriadCandidates,
    model: TriadModel,
    parameters: PoseParameters,
) -> list[MeasuredTriad]:
    """Return the measured triads of candidates of one marker."""
    n = len(model.balls)
    index = candidates.left[:, :n], candidates.right[:, :n]
    images = [triad_images(r, i, parameters.common_sd_mrad) for r, i in zip(rays, index, strict=True)]
    fit = adjust_poses(
        model.coordinates_mm, images, candidates.origin_mm, candidates.rotation, parameters.adjustment
    )
    in_both = (index[0] != HIDDEN) & (index[1] != HIDDEN)
    points = triangulate([r.take(i[in_both]) for r, i in zip(rays, index, strict=True)])
    point = np.full(in_both.shape, HIDDEN)
    point[in_both] = np.arange(in_both.sum())
    triads = []
    for t in range(len(candidates)):
        pose = _pose(model, images, fit, t, in_both[t], parameters)
        seen = _images_of_balls(features, (index[0][t], index[1][t]))
        balls = _balls(model, seen, points, point[t], pose)
        error = float(np.linalg.norm(_known_distance_errors(points.position_mm, point[t], model)))
        residuals = float(fit.chi2[t]), max(int(fit.dof[t]), 0)
        triads.append(MeasuredTriad(model.name, balls, pose, error, None if pose else NO_POSE, *residuals))
    return triads


def _pose(
    model: TriadModel,
    images: Sequence[TriadImages],
    fit: PoseAdjustment,
    t: int,
    in_both: Bool,
    parameters: PoseParameters,
) -> Pose | None:
    """Return the pose of a triad whose balls (n,) are in both images or not; None if it is not determined."""
    if in_both.all():
        return fit.pose(t)
    if not fit.determined[t]:
        return None
    pose = fit.pose(t)
    if in_both.sum() == 2 and len(in_both) == 3:
        a, b = (int(i) for i in np.flatnonzero(in_both))
        towards = np.mean([image.pinhole.centre_mm for image in images], axis=0) - pose.position_mm
        tilt = TiltPrior(towards, parameters.tilt_sd_deg)
        one = [image.repeat(t, 1) for image in images]
        pose = average_over_twist(model.coordinates_mm, one, pose, (a, b), tilt, parameters.twist)
    return pose if pose.rotation_sd_deg.max() <= parameters.max_rotation_sd_deg else None


def _images_of_balls(features: tuple[Features, Features], index: tuple[Int, Int]) -> list[_BallImages]:
    """Return the images of each ball from the indices (n,) of its features."""
    left, right = features
    return [
        _BallImages(
            None if i == HIDDEN else left.xy_px[i],
            None if j == HIDDEN else right.xy_px[j],
            tuple(
                side
                for side, of_side, k in zip(SIDES, features, (i, j), strict=True)
                if k != HIDDEN and of_side.is_manual[k]
            ),
        )
        for i, j in zip(*index, strict=True)
    ]


def _balls(
    model: TriadModel,
    images: Sequence[_BallImages],
    points: Triangulation,
    point: Int,
    pose: Pose | None,
) -> dict[str, Ball]:
    """Return the balls that are triangulated, indices (n,) into the points, or that follow from the pose."""
    balls: dict[str, Ball] = {}
    for b, (name, image) in enumerate(zip(model.balls, images, strict=True)):
        seen = image.left_px, image.right_px
        if point[b] != HIDDEN:
            k = point[b]
            parallax = float(points.parallax_mm[k])
            balls[name] = Ball(
                points.position_mm[k], points.covariance_mm2[k], *seen, parallax, image.manual_in
            )
        elif pose is not None:
            balls[name] = Ball(*_ball_of_pose(model.coordinates_mm[b], pose), *seen, None, image.manual_in)
    return balls


def _ball_of_pose(model_mm: Float, pose: Pose) -> tuple[Float, Float]:
    """Return position (3,) and covariance (3, 3) of a ball (3,) of the marker that follow from its pose."""
    arm = pose.rotation @ model_mm
    J = np.concatenate([np.eye(3), -cross_matrix(arm) * np.radians(1.0)], axis=1)
    return pose.position_mm + arm, J @ pose.covariance @ J.T


def _known_distance_errors(position_mm: Float, point: Int, model: TriadModel) -> Float:
    """Return the distance errors (k,) between balls that are triangulated, indices (n,) into positions (m, 3)."""
    known = np.all(point[model.pairs] != HIDDEN, axis=1)
    a, b = position_mm[point[model.pairs[known]].T]
    return np.asarray(np.linalg.norm(a - b, axis=1) - model.distances_mm[known])
