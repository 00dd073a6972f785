"""Expected accuracy over the depth of a rig: one triad at several heights."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Rig
from spinewatch.markers import TriadModel
from spinewatch.planning.accuracy import expected_poses, in_view
from spinewatch.triads.pose import Pose


@dataclass(frozen=True, eq=False)
class DepthAccuracy:
    """Expected accuracy of a level triad at one height.

    Attributes
    ----------
    height_mm
        Height above the point in which the optical axes meet, mm.
    position_sd_mm
        Standard deviations of P along the object axes, shape (3,), mm.
    rotation_sd_deg
        Standard deviations of the rotation about the triad's x, y and z, shape (3,), degrees.
    largest_sd_mm
        Standard deviation of P in the direction in which it is largest, mm.
    largest_direction
        That direction, unit vector with z upwards, shape (3,), object axes.
    pixel_mm
        Width of a pixel at this height, the mean of both cameras, mm.
    in_view
        Whether the centres of all balls lie inside both images.
    """

    height_mm: float
    position_sd_mm: Float
    rotation_sd_deg: Float
    largest_sd_mm: float
    largest_direction: Float
    pixel_mm: float
    in_view: bool


def accuracy_over_depth(
    rig: Rig,
    model: TriadModel,
    middle: Pose,
    heights_mm: Sequence[float],
    sigma_px: float,
    common_sd_mrad: float = 0.0,
) -> tuple[DepthAccuracy, ...]:
    """Return the accuracy of a triad that is moved up and down.

    Parameters
    ----------
    rig
        The calibrated cameras.
    model
        The marker.
    middle
        Pose of the triad at height 0; its covariance is ignored.
    heights_mm
        Heights, along Z of object space, mm.
    sigma_px
        Standard deviation of a ball's centre, per axis, px.
    common_sd_mrad
        Standard deviation of the pointing error that the balls of a triad share in a view, mrad.

    Returns
    -------
    tuple of DepthAccuracy
        One per height.

    Examples
    --------
    >>> from spinewatch.markers import FLAT_10_14_18
    >>> from spinewatch.planning.accuracy import straight_chain
    >>> from spinewatch.planning.planned_rig import planned_rig
    >>> middle = straight_chain(("T9",), np.zeros(3), 50.0)[0]
    >>> low, high = accuracy_over_depth(planned_rig(), FLAT_10_14_18, middle, (-50.0, 50.0), 0.1)
    >>> low.largest_sd_mm > high.largest_sd_mm
    True
    """
    poses = [
        Pose(middle.position_mm + np.array([0.0, 0.0, height]), middle.rotation, middle.covariance)
        for height in heights_mm
    ]
    expected = expected_poses(rig, model, poses, sigma_px, common_sd_mrad)
    shown = in_view(rig, model, poses)
    return tuple(
        DepthAccuracy(
            height_mm=float(height),
            position_sd_mm=pose.position_sd_mm,
            rotation_sd_deg=pose.rotation_sd_deg,
            largest_sd_mm=sd,
            largest_direction=direction,
            pixel_mm=pixel_mm(rig, pose.position_mm),
            in_view=bool(visible),
        )
        for height, pose, visible in zip(heights_mm, expected, shown, strict=True)
        for sd, direction in [_largest(pose.covariance[:3, :3])]
    )


def pixel_mm(rig: Rig, point_mm: Float) -> float:
    """Return the width of a pixel at a point, the mean of both cameras.

    Parameters
    ----------
    rig
        The cameras.
    point_mm
        The point, shape (3,), object space, mm.

    Returns
    -------
    float
        Width across the optical axis, mm.
    """
    cameras = (rig.left, rig.right)
    depths = [float((camera.centre - point_mm) @ camera.M[2]) for camera in cameras]
    widths = [
        depth * camera.pixel_size_mm[0] / camera.focal_length_mm
        for depth, camera in zip(depths, cameras, strict=True)
    ]
    return float(np.mean(widths))


def _largest(covariance_mm2: Float) -> tuple[float, Float]:
    """Return the largest standard deviation of a position and its direction, upwards."""
    values, vectors = np.linalg.eigh(covariance_mm2)
    direction = vectors[:, -1]
    return float(np.sqrt(values[-1])), direction * (1.0 if direction[2] >= 0 else -1.0)
