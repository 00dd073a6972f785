"""How well a rig reconstructs: control points (SIM3D, Table 3.4), points left out, distances and angles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.errors import ConvergenceError
from spinewatch.calibration.points import Shot
from spinewatch.calibration.solve.collinearity import NAMES, camera_from_vector, camera_vector
from spinewatch.calibration.stereo import Calibration
from spinewatch.camera import Camera, Rig
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.geometry.transforms import RigidTransform, fit_rigid
from spinewatch.geometry.triangulation import triangulate


@dataclass(frozen=True, eq=False)
class ShotAccuracy:
    """Residuals of reconstructed control points of one shot.

    ``used`` tells whether the shot took part in the adjustment; numbers of those that did are too good by half.
    ``residuals_mm`` (n, 3) reconstructed less control; ``mean_mm`` and ``sd_mm`` (3,) per axis.
    """

    name: str
    used: bool
    ids: tuple[str, ...]
    residuals_mm: Float

    @property
    def mean_mm(self) -> Float:
        """Mean residual per axis, mm; NaN without points."""
        return _mean(self.residuals_mm)

    @property
    def sd_mm(self) -> Float:
        """Standard deviation of residuals per axis, mm; NaN below two points."""
        return spread(self.residuals_mm)


@dataclass(frozen=True, eq=False)
class SizeError:
    """Errors of distances of about ``size_mm`` and of angles between legs of that length.

    ``distance_sd_mm`` and ``angle_sd_deg`` are root mean squares over ``count`` measurements.
    """

    size_mm: float
    distance_sd_mm: float
    angle_sd_deg: float
    count: int


def reconstruct(rig: Rig, left_px: Float, right_px: Float) -> Float:
    """Return the object points (n, 3) of n pairs of image points (eq. 5.15).

    Raises ``ConvergenceError`` when the rays determine none.
    """
    rays = [camera.rays(pixels, np.eye(2)) for camera, pixels in ((rig.left, left_px), (rig.right, right_px))]
    try:
        return triangulate(rays).position_mm
    except np.linalg.LinAlgError as error:
        raise ConvergenceError(
            "the rays of left and right points do not meet; check the coordinates, which are in mm and px"
        ) from error


def common_points(shot: Shot) -> tuple[tuple[str, ...], Float, Float, Float]:
    """Return ids, control points (n, 3) and left and right pixels (n, 2) of the points seen in both images."""
    rows = {id_: i for i, id_ in enumerate(shot.right.ids)}
    pairs = [(i, rows[id_]) for i, id_ in enumerate(shot.left.ids) if id_ in rows]
    i, j = (
        (np.array(k, dtype=np.intp) for k in zip(*pairs, strict=True))
        if pairs
        else (np.empty(0, np.intp),) * 2
    )
    ids = tuple(shot.left.ids[k] for k in i)
    return ids, shot.left.control_mm[i], shot.left.pixels[i], shot.right.pixels[j]


def shot_accuracy(rig: Rig, shot: Shot, *, used: bool, defines_object_space: bool) -> ShotAccuracy:
    """Return the residuals of a shot's control points reconstructed by a rig.

    Unless the shot defines object space, the board's rigid motion is removed first. Fewer than three common
    points cannot tell a rigid motion: no residuals then.
    """
    ids, control, left, right = common_points(shot)
    if len(ids) < 3:
        return ShotAccuracy(shot.name, used, (), np.empty((0, 3)))
    points = reconstruct(rig, left, right)
    if not defines_object_space:
        points = fit_rigid(points, control)(points)
    return ShotAccuracy(shot.name, used, ids, points - control)


def calibration_accuracy(calibration: Calibration, others: Sequence[Shot] = ()) -> tuple[ShotAccuracy, ...]:
    """Return the accuracy for the shots used, without removed points, and then for the ``others``, not used."""
    used = [
        shot_accuracy(calibration.rig, shot, used=True, defines_object_space=i == 0)
        for i, shot in enumerate(calibration.without_removed())
    ]
    fresh = [shot_accuracy(calibration.rig, s, used=False, defines_object_space=False) for s in others]
    return (*used, *fresh)


def leave_one_out(calibration: Calibration) -> ShotAccuracy | None:
    """Return residuals of every control point reconstructed by the rig that would be without it, in all shots.

    The rig without a point follows from the adjusted one in one Gauss-Newton step, which for one point in
    many is exact to second order. None when leaving a point out leaves nothing determined.
    """
    adjustment = calibration.adjustment
    if adjustment.block.redundancy <= 6 or not np.all(np.isfinite(adjustment.cofactor)):
        return None
    ids: list[str] = []
    residuals: list[Float] = []
    for s, shot in enumerate(calibration.without_removed()):
        for id_, control, left, right in zip(*common_points(shot), strict=True):
            moved = _without_point(calibration, id_)
            if moved is None:
                continue
            rig, placements = moved
            point = reconstruct(rig, left[None], right[None])[0]
            residuals.append(placements[s].inverse()(point[None])[0] - control)
            ids.append(id_)
    return ShotAccuracy("left out one by one", False, tuple(ids), np.array(residuals)) if ids else None


def _without_point(calibration: Calibration, id_: str) -> tuple[Rig, list[RigidTransform]] | None:
    adjustment = calibration.adjustment
    rows, r = [], []
    for view, image in adjustment.block.images.items():
        if id_ in image.ids:
            i = image.ids.index(id_)
            at = adjustment.rows[view].start + 2 * i
            rows += [at, at + 1]
            r.append(-adjustment.residuals_px[view][i] / image.sd_px[i])
    A = adjustment.jacobian[rows]
    H = A @ adjustment.cofactor @ A.T
    rest = np.eye(len(H)) - H
    if np.linalg.eigvalsh(rest)[0] < 1e-3:
        return None
    change = adjustment.cofactor @ A.T @ np.linalg.solve(rest, np.concatenate(r))
    return _changed(calibration, change)


def _changed(calibration: Calibration, change: Float) -> tuple[Rig, list[RigidTransform]]:
    block, first = calibration.adjustment.block, 0
    cameras: list[Camera] = []
    for camera, free in zip(block.cameras, block.free, strict=True):
        v = camera_vector(camera)
        v[[NAMES.index(n) for n in free]] += change[first : first + len(free)]
        first += len(free)
        cameras.append(camera_from_vector(v, camera))
    moves = np.vstack([np.zeros((1, 6)), change[first:].reshape(-1, 6)])
    placements = [
        RigidTransform(rotation_from_vector(m[:3]) @ p.rotation, p.translation_mm + m[3:])
        for p, m in zip(block.placements, moves, strict=True)
    ]
    return Rig(calibration.rig.name, cameras[0], cameras[1]), placements


def board_angles(
    accuracy: Sequence[Float], control: Sequence[Float], edges_mm: Sequence[float]
) -> list[SizeError]:
    """Return errors of distances and angles on the board itself, by size class.

    ``accuracy`` holds per shot the residuals (n, 3), ``control`` the control points (n, 3); a size class
    reaches from one of ``edges_mm`` to the next. An angle is counted by its shorter leg.
    """
    sizes, lengths, legs, angles = [], [], [], []
    for residual, points in zip(accuracy, control, strict=True):
        measured = points + residual
        for i, j in combinations(range(len(points)), 2):
            true = float(np.linalg.norm(points[i] - points[j]))
            sizes.append(true)
            lengths.append(float(np.linalg.norm(measured[i] - measured[j])) - true)
        for v in range(len(points)):
            rest = [i for i in range(len(points)) if i != v]
            for i, j in combinations(rest, 2):
                legs.append(min(np.linalg.norm(points[k] - points[v]) for k in (i, j)))
                angles.append(_angle(measured, v, i, j) - _angle(points, v, i, j))
    return _by_size(np.array(sizes), np.array(lengths), np.array(legs), np.array(angles), edges_mm)


def _angle(points: Float, vertex: int, i: int, j: int) -> float:
    a, b = points[i] - points[vertex], points[j] - points[vertex]
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b)))


def _by_size(
    sizes: Float, lengths: Float, legs: Float, angles: Float, edges_mm: Sequence[float]
) -> list[SizeError]:
    out = []
    for low, high in pairwise(edges_mm):
        d, a = (sizes >= low) & (sizes < high), (legs >= low) & (legs < high)
        if d.any() and a.any():
            out.append(SizeError((low + high) / 2, _rms(lengths[d]), _rms(angles[a]), int(a.sum())))
    return out


def simulated_angles(
    true: Rig,
    assumed: Sequence[Rig],
    centre_mm: Float,
    sizes_mm: Sequence[float],
    sigma_px: float,
    rng: np.random.Generator,
    count: int = 200,
) -> list[SizeError]:
    """Return errors of distances and right angles of given sizes, simulated around a centre (3,).

    Rods and right angles lie anyhow; their ends are seen by the ``true`` rig with noise ``sigma_px`` and
    reconstructed by the ``assumed`` rigs in turn, so that the calibration's own uncertainty counts.
    """
    out = []
    for size in sizes_mm:
        a, b = _random_frames(rng, count)
        vertex = centre_mm + rng.uniform(-50, 50, (count, 3))
        points = np.stack([vertex, vertex + size * a, vertex + size * b], axis=1)
        measured = np.empty_like(points)
        left, right = (
            camera.project(points) + sigma_px * rng.standard_normal((count, 3, 2))
            for camera in (true.left, true.right)
        )
        for k, rig in enumerate(assumed):
            mine = np.arange(count) % len(assumed) == k
            measured[mine] = reconstruct(rig, left[mine].reshape(-1, 2), right[mine].reshape(-1, 2)).reshape(
                -1, 3, 3
            )
        seen = np.isfinite(measured).all(axis=(1, 2))
        distance = np.linalg.norm(measured[seen, 1] - measured[seen, 0], axis=1) - size
        angle = np.array([_angle(m, 0, 1, 2) for m in measured[seen]]) - 90
        out.append(SizeError(float(size), _rms(distance), _rms(angle), int(seen.sum())))
    return out


def _random_frames(rng: np.random.Generator, count: int) -> tuple[Float, Float]:
    a = rng.standard_normal((count, 3))
    a /= np.linalg.norm(a, axis=1, keepdims=True)
    b = np.cross(a, rng.standard_normal((count, 3)))
    return a, b / np.linalg.norm(b, axis=1, keepdims=True)


def _rms(values: Float) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


def _mean(residuals_mm: Float) -> Float:
    return residuals_mm.mean(axis=0) if len(residuals_mm) else np.full(3, np.nan)


def spread(residuals_mm: Float) -> Float:
    """Return the standard deviation per axis (3,) of residuals (n, 3), NaN below two points."""
    return residuals_mm.std(axis=0, ddof=1) if len(residuals_mm) > 1 else np.full(3, np.nan)
