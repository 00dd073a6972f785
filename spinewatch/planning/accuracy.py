"""What a rig and its markers can measure, before surgery: predicted standard deviations, and better markers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from spinewatch.arrays import Float
from spinewatch.camera import Rig
from spinewatch.errors import ParameterError
from spinewatch.markers import TriadModel
from spinewatch.simulation.observations import ball_centres
from spinewatch.spine.motion import relative_motion
from spinewatch.triads.pose import Pose
from spinewatch.triads.pose_adjustment import adjust_poses
from spinewatch.triads.pose_fit import triad_view

_COARSE_DEG, _FINE_DEG = 10.0, 2.0


@dataclass(frozen=True, eq=False)
class PlannedTriad:
    """Standard deviations of one vertebra's triad.

    ``position_sd_mm`` (3,) along the object axes; about the triad's normal, ``in_plane_sd_deg``, and the
    larger of those about its x and y, ``out_of_plane_sd_deg``; ``motion_sd_mm`` (3,) and ``motion_sd_deg``
    (3,) between two stages relative to the reference, in its axes, NaN for the reference itself. ``in_view``:
    all its balls lie in both images.
    """

    vertebra: str
    position_sd_mm: Float
    in_plane_sd_deg: float
    out_of_plane_sd_deg: float
    motion_sd_mm: Float
    motion_sd_deg: Float
    in_view: bool


@dataclass(frozen=True, eq=False)
class Plan:
    """Predictions for a row of triads; ``cobb_sd_deg`` of the angle between its ends about Z, at one stage."""

    model: TriadModel
    triads: tuple[PlannedTriad, ...]
    cobb_sd_deg: float


def plan(
    rig: Rig,
    model: TriadModel,
    vertebrae: Sequence[str],
    poses: Sequence[Pose],
    sigma_px: float,
    common_sd_mrad: float = 0.0,
) -> Plan:
    """Return what the rig will tell of triads in these poses, of which the first is the reference.

    From the normal equations at the truth: nothing is simulated. The Cobb angle is that of a patient who lies
    prone under the cameras, whose coronal plane is the object plane XY.
    """
    measured = predicted_poses(rig, model, poses, sigma_px, common_sd_mrad)
    named = dict(zip(vertebrae, measured, strict=True))
    motions = {m.vertebra: m for m in relative_motion(named, named, vertebrae[0])}
    nothing = np.full(3, np.nan)
    images = [
        camera.project(ball_centres(poses, model)) / (np.array(camera.image_size_px) - 1)
        for camera in (rig.left, rig.right)
    ]
    in_view = np.all([np.all((image >= 0) & (image <= 1), axis=(1, 2)) for image in images], axis=0)
    triads = tuple(
        PlannedTriad(
            vertebra=name,
            position_sd_mm=pose.position_sd_mm,
            in_plane_sd_deg=float(pose.rotation_sd_deg[2]),
            out_of_plane_sd_deg=float(pose.rotation_sd_deg[:2].max()),
            motion_sd_mm=motions[name].translation_sd_mm if name in motions else nothing,
            motion_sd_deg=motions[name].rotation_sd_deg if name in motions else nothing,
            in_view=bool(in_view[i]),
        )
        for i, (name, pose) in enumerate(named.items())
    )
    ends = measured[0].covariance[5, 5] + measured[-1].covariance[5, 5]
    return Plan(model, triads, float(np.sqrt(ends)))


def predicted_poses(
    rig: Rig, model: TriadModel, poses: Sequence[Pose], sigma_px: float, common_sd_mrad: float = 0.0
) -> tuple[Pose, ...]:
    """Return the poses with the covariance that centres of one standard deviation, px per axis, would give."""
    balls = ball_centres(poses, model)
    index = np.arange(balls.shape[0] * balls.shape[1]).reshape(balls.shape[:2])
    views = []
    for camera in (rig.left, rig.right):
        xy = camera.project(balls.reshape(-1, 3))
        rays = camera.rays(xy, sigma_px**2 * np.eye(2))
        views.append(triad_view(rays, index, common_sd_mrad))
    P, R = np.stack([pose.position_mm for pose in poses]), np.stack([pose.rotation for pose in poses])
    fit = adjust_poses(model.coordinates_mm, views, P, R, steps=1)
    return tuple(Pose(*truth) for truth in zip(P, R, fit.covariance, strict=True))


def straight_row(
    vertebrae: Sequence[str], middle_mm: Float, spacing_mm: float, axis: int = 0
) -> tuple[Pose, ...]:
    """Return level triads along an object axis, evenly spaced about a point, their x along the row."""
    R = np.eye(3) if axis == 0 else np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    along = spacing_mm * (np.arange(len(vertebrae)) - (len(vertebrae) - 1) / 2)
    places = middle_mm + along[:, None] * np.eye(3)[axis]
    return tuple(Pose(place, R, np.zeros((6, 6))) for place in places)


def best_marker(
    rig: Rig,
    poses: Sequence[Pose],
    sigma_px: float,
    disc_radius_mm: float,
    *,
    least_difference_mm: float = 4.0,
    ball_diameter_mm: float = 8.0,
) -> TriadModel:
    """Return the flat marker of three balls in a disc whose worst rotation is measured best, on average.

    The open question of the thesis's conclusion. Balls lie on the disc's rim, since pulling one inwards only
    shortens distances; its centre is P. Distances differ by ``least_difference_mm``, so that the balls can be
    told apart. Raises ``ParameterError`` when no such marker fits the disc.
    """
    grid = np.arange(_COARSE_DEG, 360, _COARSE_DEG)
    near = np.arange(-_COARSE_DEG / 2, _COARSE_DEG / 2 + 1e-9, _FINE_DEG)
    candidates = [(float(a), float(b)) for a, b in combinations(grid, 2)]
    best = candidates[0]
    for _ in range(2):
        markers = {
            angles: marker
            for angles in candidates
            if (marker := _rim_marker(angles, disc_radius_mm, ball_diameter_mm, least_difference_mm))
        }
        if not markers:
            raise ParameterError(
                f"no three balls with distances {least_difference_mm:g} mm apart fit a disc of radius"
                f" {disc_radius_mm:g} mm; allow a larger disc or a smaller difference"
            )
        best = min(markers, key=lambda angles: _worst_rotation(rig, markers[angles], poses, sigma_px))
        candidates = [(best[0] + float(a), best[1] + float(b)) for a in near for b in near]
    return markers[best]


def _worst_rotation(rig: Rig, model: TriadModel, poses: Sequence[Pose], sigma_px: float) -> float:
    worst = [pose.rotation_sd_deg.max() for pose in predicted_poses(rig, model, poses, sigma_px)]
    return float(np.sqrt(np.mean(np.square(worst))))


def _rim_marker(
    angles_deg: tuple[float, float], radius_mm: float, ball_diameter_mm: float, least_difference_mm: float
) -> TriadModel | None:
    turn = np.radians([0.0, *angles_deg])
    rim = radius_mm * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(3)])
    lengths = np.array([np.linalg.norm(rim[a] - rim[b]) for a, b in combinations(range(3), 2)])
    apart = np.diff(np.sort(lengths)).min() >= least_difference_mm
    if not apart or lengths.min() < 1.5 * ball_diameter_mm:
        return None
    z = np.cross(rim[0] - rim[2], rim[0] - rim[1])[2]
    if z < 0:
        rim[:, 1] *= -1
    return TriadModel(f"disc-{radius_mm:g}", ("XX", "YY", "MX"), rim, ball_diameter_mm)
