"""Control fields tried by simulation before they are built (section 3.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.control_field import ControlField
from spinewatch.calibration.errors import CalibrationError
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.quality.accuracy import shot_accuracy, spread
from spinewatch.calibration.solve.resection import SolveParameters
from spinewatch.calibration.stereo import calibrate
from spinewatch.camera import Camera, Rig


@dataclass(frozen=True, eq=False)
class DesignTrial:
    """What simulated calibrations with a control field came to.

    ``seen`` ids of points in both images; ``converged`` fraction of trials; ``used_sd_mm`` and ``fresh_sd_mm``
    (3,) mean standard deviations of reconstructed control points in the shot used and in a shot not used;
    ``errors`` codes of the trials that were refused.
    """

    seen: tuple[str, ...]
    converged: float
    used_sd_mm: Float
    fresh_sd_mm: Float
    errors: tuple[str, ...]


def try_design(
    field: ControlField,
    rig: Rig,
    sigma_px: float,
    rng: np.random.Generator,
    *,
    point_sd_mm: float = 0.0,
    trials: int = 20,
    ids: tuple[str, ...] | None = None,
    parameters: SolveParameters | None = None,
) -> DesignTrial:
    """Return what ``trials`` calibrations of a rig with a control field come to.

    Image points carry noise ``sigma_px``; the field as built differs from its coordinates by ``point_sd_mm`` per
    axis, drawn anew in each trial and the same for both of its shots. ``ids`` limits the points; without it,
    all that both cameras see are used.
    """
    seen = ids or visible_in_both(rig, field)
    control = field.take(seen)
    used: list[Float] = []
    fresh: list[Float] = []
    errors: list[str] = []
    for _ in range(trials):
        built = control + point_sd_mm * rng.standard_normal(control.shape)
        shots = [_shot(name, rig, seen, control, built, sigma_px, rng) for name in ("used", "fresh")]
        try:
            calibration = calibrate(shots[:1], (_sensor(rig.left), _sensor(rig.right)), parameters)
        except CalibrationError as error:
            errors.append(error.code)
            continue
        for shot, out in zip(shots, (used, fresh), strict=True):
            residuals = shot_accuracy(
                calibration.rig, shot, used=shot.name == "used", defines_object_space=True
            )
            out.append(spread(residuals.residuals_mm))
    none = np.full(3, np.nan)
    return DesignTrial(
        seen,
        len(used) / trials,
        np.mean(used, axis=0) if used else none,
        np.mean(fresh, axis=0) if fresh else none,
        tuple(errors),
    )


def visible_in_both(rig: Rig, field: ControlField, margin_px: float = 0.0) -> tuple[str, ...]:
    """Return the ids of control points that lie in both images, a margin away from their borders."""
    seen = np.ones(len(field), dtype=bool)
    for camera in (rig.left, rig.right):
        with np.errstate(all="ignore"):
            pixels = camera.project(field.points_mm)
            last = np.array(camera.image_size_px) - 1 - margin_px
            seen &= np.all((pixels >= margin_px) & (pixels <= last), axis=1)
    return tuple(id_ for id_, ok in zip(field.ids, seen, strict=True) if ok)


def _sensor(camera: Camera) -> Sensor:
    return Sensor(camera.image_size_px, camera.pixel_size_mm)


def _shot(
    name: str,
    rig: Rig,
    ids: tuple[str, ...],
    control: Float,
    built: Float,
    sigma_px: float,
    rng: np.random.Generator,
) -> Shot:
    left, right = (
        ImagePoints.build(ids, control, camera.project(built) + sigma_px * rng.standard_normal((len(ids), 2)))
        for camera in (rig.left, rig.right)
    )
    return Shot(name, left, right)
