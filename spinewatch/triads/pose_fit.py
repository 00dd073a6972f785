"""Measured triads of chosen features: balls, poses of greatest likelihood, and their covariances."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Float, Int
from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.geometry.rays import Rays
from spinewatch.geometry.rotations import cross_matrix
from spinewatch.geometry.triangulation import Triangulation, triangulate
from spinewatch.markers import TriadModel
from spinewatch.matching.selection import HIDDEN, TriadCandidates
from spinewatch.triads.pose import Ball, MeasuredTriad, Pose
from spinewatch.triads.pose_adjustment import PoseAdjustment, TriadImages, adjust_poses
from spinewatch.triads.twist import Tilt, average_over_turn


@dataclass(frozen=True)
class PoseParameters:
    """What is known of errors and poses.

    ``common_sd_mrad`` is the pointing error that the balls of a triad share in one view, 0.09 px on the cart:
    calibration, and light that comes from one side; averaging over the balls does not lessen it.
    ``tilt_sd_deg`` of z against the direction of the cameras helps only where a ball is hidden, and a pose
    that is less certain than ``max_rotation_sd_deg`` is none.
    """

    common_sd_mrad: float = 0.12
    tilt_sd_deg: float = 18.0
    max_rotation_sd_deg: float = 15.0


NO_POSE = "the balls that are seen do not determine the pose"


def fit_poses(
    left: Features,
    right: Features,
    rig: Rig,
    chosen: TriadCandidates,
    models: Sequence[TriadModel],
    parameters: PoseParameters | None = None,
) -> tuple[MeasuredTriad, ...]:
    """Return the triads whose balls are the chosen features, in their order.

    The covariance of a feature is that of its own error. Where the balls seen leave a motion free, or nearly
    so, the pose is None.
    """
    parameters = parameters or PoseParameters()
    rays = left.rays(rig.left), right.rays(rig.right)
    measured: dict[int, MeasuredTriad] = {}
    for index, model in enumerate(models):
        where = np.flatnonzero(chosen.model == index)
        if len(where):
            part = chosen.take(where)
            triads = _measure_one_model((left, right), rays, part, model, parameters)
            measured.update(zip(where.tolist(), triads, strict=True))
    return tuple(measured[i] for i in range(len(chosen)))


def triad_view(rays: Rays, index: Int, common_sd_mrad: float = 0.0) -> TriadImages:
    """Return the images of t triads whose n balls are the rays ``index`` (t, n), ``HIDDEN`` for none."""
    seen = index != HIDDEN
    safe = np.where(seen, index, 0)
    weight = np.linalg.inv(rays.covariance_mm2)[safe] * seen[..., None, None]
    common = rays.pinhole.focal_length_mm * common_sd_mrad / 1000
    return TriadImages(rays.pinhole, rays.ideal_mm[safe], weight, common)


def _measure_one_model(
    features: tuple[Features, Features],
    rays: tuple[Rays, Rays],
    chosen: TriadCandidates,
    model: TriadModel,
    parameters: PoseParameters,
) -> list[MeasuredTriad]:
    n = len(model.balls)
    index = chosen.left[:, :n], chosen.right[:, :n]
    views = [triad_view(r, i, parameters.common_sd_mrad) for r, i in zip(rays, index, strict=True)]
    fit = adjust_poses(model.coordinates_mm, views, chosen.origin_mm, chosen.rotation)
    both = (index[0] != HIDDEN) & (index[1] != HIDDEN)
    found = triangulate([r.take(i[both]) for r, i in zip(rays, index, strict=True)])
    place = np.full(both.shape, HIDDEN)
    place[both] = np.arange(both.sum())
    poses = [
        fit.pose(t) if both[t].all() else _turned(model, views, fit, t, both[t], parameters)
        for t in range(len(chosen))
    ]
    return [
        _triad(features, (index[0][t], index[1][t]), found, place[t], poses[t], model)
        for t in range(len(chosen))
    ]


def _turned(
    model: TriadModel,
    views: Sequence[TriadImages],
    fit: PoseAdjustment,
    t: int,
    both: NDArray[np.bool_],
    parameters: PoseParameters,
) -> Pose | None:
    """Return the pose of a marker with hidden balls, None where it is not determined."""
    if not fit.determined[t]:
        return None
    pose = fit.pose(t)
    if both.sum() == 2 and len(both) == 3:
        a, b = (int(i) for i in np.flatnonzero(both))
        towards = np.mean([view.pinhole.centre_mm for view in views], axis=0) - pose.position_mm
        one = [
            TriadImages(v.pinhole, v.ideal_mm[t : t + 1], v.weight[t : t + 1], v.common_sd_mm) for v in views
        ]
        pose = average_over_turn(
            model.coordinates_mm, one, pose, (a, b), Tilt(towards, parameters.tilt_sd_deg)
        )
    return pose if pose.rotation_sd_deg.max() <= parameters.max_rotation_sd_deg else None


def _triad(
    features: tuple[Features, Features],
    index: tuple[Int, Int],
    found: Triangulation,
    place: Int,
    pose: Pose | None,
    model: TriadModel,
) -> MeasuredTriad:
    balls: dict[str, Ball] = {}
    for b, name in enumerate(model.balls):
        images = [
            None if i[b] == HIDDEN else side.xy_px[i[b]] for side, i in zip(features, index, strict=True)
        ]
        if place[b] != HIDDEN:
            k = place[b]
            position, S, parallax = found.position_mm[k], found.covariance_mm2[k], float(found.parallax_mm[k])
            balls[name] = Ball(position, S, images[0], images[1], parallax)
        elif pose is not None:
            balls[name] = Ball(*_carried(model.coordinates_mm[b], pose), images[0], images[1], None)
    error = float(np.linalg.norm(_known_errors(found.position_mm, place, model)))
    return MeasuredTriad(model.name, balls, pose, error, None if pose else NO_POSE)


def _carried(model_mm: Float, pose: Pose) -> tuple[Float, Float]:
    """Return position (3,) and covariance (3, 3) of a ball that is known from the marker's pose."""
    arm = pose.rotation @ model_mm
    J = np.concatenate([np.eye(3), -cross_matrix(arm) * np.radians(1.0)], axis=1)
    return pose.position_mm + arm, J @ pose.covariance @ J.T


def _known_errors(positions: Float, place: Int, model: TriadModel) -> Float:
    known = np.all(place[model.pairs] != HIDDEN, axis=1)
    a, b = positions[place[model.pairs[known]].T]
    return np.asarray(np.linalg.norm(a - b, axis=1) - model.distances_mm[known])
