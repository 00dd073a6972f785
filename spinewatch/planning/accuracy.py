"""Expected accuracy: standard deviations of poses, motion and Cobb angle that a rig and a marker will give.

They follow from the normal equations at the true poses; nothing is simulated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Bool, Float
from spinewatch.camera import Rig
from spinewatch.markers import TriadModel
from spinewatch.spine.motion import relative_motion
from spinewatch.triads.pose import Pose, ball_centres
from spinewatch.triads.pose_adjustment import PoseAdjustmentParameters, adjust_poses, triad_images


@dataclass(frozen=True, eq=False)
class TriadAccuracy:
    """Expected standard deviations of one vertebra's triad.

    Attributes
    ----------
    vertebra
        Name of the vertebra.
    position_sd_mm
        Standard deviations of P along the object axes, shape (3,), mm.
    in_plane_sd_deg
        Standard deviation of the rotation about the triad's normal, degrees.
    out_of_plane_sd_deg
        The larger standard deviation of the rotations about the triad's x and y, degrees.
    motion_sd_mm
        Standard deviations of the displacement between two stages, in the axes of the reference triad, shape (3,),
        mm; NaN for the reference.
    motion_sd_deg
        Standard deviations of the rotation vector between two stages, in the same axes, shape (3,), degrees; NaN for
        the reference.
    in_view
        Whether the centres of all balls lie inside both images.
    """

    vertebra: str
    position_sd_mm: Float
    in_plane_sd_deg: float
    out_of_plane_sd_deg: float
    motion_sd_mm: Float
    motion_sd_deg: Float
    in_view: bool


@dataclass(frozen=True, eq=False)
class ExpectedAccuracy:
    """Expected accuracy of a chain of triads.

    Attributes
    ----------
    model
        The marker.
    triads
        One entry per vertebra, in the order given.
    cobb_sd_deg
        Standard deviation of the angle between the first and the last triad about Z, at one stage, degrees.
    """

    model: TriadModel
    triads: tuple[TriadAccuracy, ...]
    cobb_sd_deg: float


def expected_accuracy(
    rig: Rig,
    model: TriadModel,
    vertebrae: Sequence[str],
    poses: Sequence[Pose],
    sigma_px: float,
    common_sd_mrad: float = 0.0,
) -> ExpectedAccuracy:
    """Return the accuracy with which a rig will measure triads in given poses.

    The Cobb angle is that of a patient lying prone under the cameras, whose coronal plane is the object plane XY.

    Parameters
    ----------
    rig
        The calibrated cameras.
    model
        The marker on every vertebra.
    vertebrae
        Names of the vertebrae, the reference first.
    poses
        True pose of each triad; covariances are ignored.
    sigma_px
        Standard deviation of a ball's centre, per axis, px.
    common_sd_mrad
        Standard deviation of the pointing error that the balls of a triad share in a view, mrad.

    Returns
    -------
    ExpectedAccuracy
        Standard deviations per triad and of the Cobb angle.

    References
    ----------
    T. Luhmann et al., Close-Range Photogrammetry and 3D Imaging (2014), ch. 7: network design from the normal
    equations; docs/method.md.

    Examples
    --------
    >>> from spinewatch.markers import FLAT_10_14_18
    >>> from spinewatch.simulation.rigs import convergence_point, large_rig
    >>> rig = large_rig()
    >>> poses = straight_chain(("L1", "T9"), convergence_point(rig), 80.0)
    >>> coarse, fine = (
    ...     expected_accuracy(rig, FLAT_10_14_18, ("L1", "T9"), poses, sigma).cobb_sd_deg for sigma in (0.2, 0.1)
    ... )
    >>> round(coarse / fine, 6)
    2.0
    """
    expected = expected_poses(rig, model, poses, sigma_px, common_sd_mrad)
    named = dict(zip(vertebrae, expected, strict=True))
    motions = {m.vertebra: m for m in relative_motion(named, named, vertebrae[0])}
    undefined = np.full(3, np.nan)
    triads = tuple(
        TriadAccuracy(
            vertebra=name,
            position_sd_mm=pose.position_sd_mm,
            in_plane_sd_deg=float(pose.rotation_sd_deg[2]),
            out_of_plane_sd_deg=float(pose.rotation_sd_deg[:2].max()),
            motion_sd_mm=motions[name].translation_sd_mm if name in motions else undefined,
            motion_sd_deg=motions[name].rotation_sd_deg if name in motions else undefined,
            in_view=bool(visible),
        )
        for (name, pose), visible in zip(named.items(), in_view(rig, model, poses), strict=True)
    )
    cobb_variance = expected[0].covariance[5, 5] + expected[-1].covariance[5, 5]
    return ExpectedAccuracy(model, triads, float(np.sqrt(cobb_variance)))


def expected_poses(
    rig: Rig, model: TriadModel, poses: Sequence[Pose], sigma_px: float, common_sd_mrad: float = 0.0
) -> tuple[Pose, ...]:
    """Return poses with the covariance that their measurement would have.

    Parameters
    ----------
    rig
        The calibrated cameras.
    model
        The marker.
    poses
        True poses; their covariances are ignored.
    sigma_px
        Standard deviation of a ball's centre, per axis, px.
    common_sd_mrad
        Standard deviation of the pointing error that the balls of a triad share in a view, mrad.

    Returns
    -------
    tuple of Pose
        The same poses with the covariance of the pose adjustment.
    """
    P, R = np.stack([pose.position_mm for pose in poses]), np.stack([pose.rotation for pose in poses])
    covariance = expected_covariances(rig, model.coordinates_mm, P, R, sigma_px, common_sd_mrad)
    return tuple(Pose(*pose) for pose in zip(P, R, covariance, strict=True))


def expected_covariances(
    rig: Rig,
    model_mm: Float,
    position_mm: Float,
    rotation: Float,
    sigma_px: float,
    common_sd_mrad: float = 0.0,
) -> Float:
    """Return the covariances that measured poses would have.

    Parameters
    ----------
    rig
        The calibrated cameras.
    model_mm
        Balls of the marker, shape (n, 3), or of the marker of each pose, shape (t, n, 3), marker frame, mm.
    position_mm, rotation
        True poses, shapes (t, 3), mm, and (t, 3, 3).
    sigma_px
        Standard deviation of a ball's centre, per axis, px.
    common_sd_mrad
        Standard deviation of the pointing error that the balls of a triad share in a view, mrad.

    Returns
    -------
    Float
        Covariances as in `Pose`, shape (t, 6, 6).
    """
    balls = position_mm[:, None] + model_mm @ np.swapaxes(rotation, -1, -2)
    index = np.arange(balls.shape[0] * balls.shape[1]).reshape(balls.shape[:2])
    views = []
    for camera in (rig.left, rig.right):
        rays = camera.rays(camera.project(balls.reshape(-1, 3)), sigma_px**2 * np.eye(2))
        views.append(triad_images(rays, index, common_sd_mrad))
    parameters = PoseAdjustmentParameters(max_steps=1)
    return adjust_poses(model_mm, views, position_mm, rotation, parameters).covariance


def straight_chain(
    vertebrae: Sequence[str], middle_mm: Float, spacing_mm: float, axis: int = 0
) -> tuple[Pose, ...]:
    """Return poses of level triads on a straight line along an object axis, their x axes along the line.

    Parameters
    ----------
    vertebrae
        Names of the vertebrae, of which only the number counts.
    middle_mm
        Middle of the chain, shape (3,), object space, mm.
    spacing_mm
        Distance between neighbours, mm.
    axis
        Object axis of the line: 0 for X, 1 for Y.

    Returns
    -------
    tuple of Pose
        One pose per vertebra, with zero covariance.
    """
    R = np.eye(3) if axis == 0 else np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    along = spacing_mm * (np.arange(len(vertebrae)) - (len(vertebrae) - 1) / 2)
    positions = middle_mm + along[:, None] * np.eye(3)[axis]
    return tuple(Pose(position, R, np.zeros((6, 6))) for position in positions)


def in_view(rig: Rig, model: TriadModel, poses: Sequence[Pose]) -> Bool:
    """Return whether the centres of all balls of a triad lie inside both images.

    Parameters
    ----------
    rig
        The cameras.
    model
        The marker.
    poses
        Poses of t triads.

    Returns
    -------
    Bool
        Whether they do, shape (t,).
    """
    balls = ball_centres(poses, model)
    fractions = [
        camera.project(balls) / (np.array(camera.image_size_px) - 1) for camera in (rig.left, rig.right)
    ]
    return np.asarray(np.all([np.all((f >= 0) & (f <= 1), axis=(1, 2)) for f in fractions], axis=0))
