"""Control field trials: calibrations with a field simulated before it is built (section 3.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.control_field import ControlField
from spinewatch.calibration.errors import CalibrationError
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.quality.accuracy import shot_accuracy
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.calibration.stereo import calibrate_stereo
from spinewatch.camera import Camera, Rig
from spinewatch.planning.field_view import visible_in_both


@dataclass(frozen=True, eq=False)
class ControlFieldTrial:
    """Result of simulated calibrations with a control field.

    Attributes
    ----------
    ids
        Control points that were used, visible in both images.
    converged
        Fraction of trials that gave a calibration.
    calibration_sd_mm
        Standard deviation of reconstructed control points in the shot that the rig was calibrated with, per axis,
        mean of the trials, shape (3,), mm; NaN when no trial converged.
    verification_sd_mm
        The same in a second shot, which was not used for calibration.
    error_codes
        Code of the error of each trial that failed.
    """

    ids: tuple[str, ...]
    converged: float
    calibration_sd_mm: Float
    verification_sd_mm: Float
    error_codes: tuple[str, ...]


def try_control_field(
    field: ControlField,
    rig: Rig,
    sigma_px: float,
    rng: np.random.Generator,
    *,
    point_sd_mm: float = 0.0,
    trials: int = 20,
    ids: tuple[str, ...] | None = None,
    parameters: SolveParameters | None = None,
) -> ControlFieldTrial:
    """Return the accuracy of simulated calibrations with a control field.

    Each trial takes two shots: one to calibrate with and one for verification.

    Parameters
    ----------
    field
        The control field.
    rig
        The true cameras.
    sigma_px
        Standard deviation of image points, per axis, px.
    rng
        Source of random numbers.
    point_sd_mm
        Standard deviation by which the field as built differs from its coordinates, per axis, mm; drawn in each
        trial, the same for both of its shots.
    trials
        Number of calibrations.
    ids
        Control points to use; by default all that lie inside both images.
    parameters
        Parameters of the calibration.

    Returns
    -------
    ControlFieldTrial
        Fraction of trials that converged, and the mean accuracy of those.

    References
    ----------
    Thesis section 3.3 and Table 3.4.

    Examples
    --------
    >>> from spinewatch.calibration.control_field import pegboard_1995
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> rng = np.random.default_rng(0)
    >>> trial = try_control_field(pegboard_1995(), table_3_3_rig(), 0.1, rng, trials=2)
    >>> trial.converged
    1.0
    """
    ids = ids or visible_in_both(rig, field)
    control = field.take(ids)
    sds: dict[str, list[Float]] = {"calibration": [], "verification": []}
    errors: list[str] = []
    for _ in range(trials):
        built = control + point_sd_mm * rng.standard_normal(control.shape)
        shots = [_shot(name, rig, ids, control, built, sigma_px, rng) for name in sds]
        try:
            calibration = calibrate_stereo(shots[:1], (_sensor(rig.left), _sensor(rig.right)), parameters)
        except CalibrationError as error:
            errors.append(error.code)
            continue
        for shot in shots:
            accuracy = shot_accuracy(calibration.rig, shot, used=shot is shots[0], defines_object_space=True)
            sds[shot.name].append(accuracy.sd_mm)
    calibration_sd, verification_sd = (
        np.mean(sd, axis=0) if sd else np.full(3, np.nan) for sd in sds.values()
    )
    return ControlFieldTrial(
        ids, (trials - len(errors)) / trials, calibration_sd, verification_sd, tuple(errors)
    )


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
    """Return a shot of the field as built (n, 3), with the coordinates ``control`` (n, 3) that are known of it."""
    left, right = (
        ImagePoints.build(ids, control, camera.project(built) + sigma_px * rng.standard_normal((len(ids), 2)))
        for camera in (rig.left, rig.right)
    )
    return Shot(name, left, right)
