"""The library's calibrations as contract models; computes with the library, so that the service does not import it."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from contract.calibration import (
    CalibrationResult,
    CameraQuality,
    CameraQualityPair,
    ControlAccuracy,
    ControlField,
    Correlation,
    Disparity,
    FitLimits,
    ImagePoint,
    ImagePointPair,
    RemovedPoint,
    ShotQuality,
    SizeAccuracy,
    StereoGeometry,
)
from contract.flag import Flag
from contract.rig import Rig
from spinewatch.calibration import from_images
from spinewatch.calibration.plausibility.fit import fit_limits
from spinewatch.calibration.plausibility.limits import CalibrationLimits
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.quality.accuracy import TABLE_3_4_SD_MM, common_points
from spinewatch.calibration.quality.size_accuracy import size_accuracy
from spinewatch.calibration.solve.bundle import rms
from spinewatch.calibration.solve.determinability import DeterminabilityParameters
from spinewatch.errors import ParameterError
from spinewatch.imaging.frame import SIDES
from spinewatch.planning.disparity import disparity_grid

_SIZE_CLASSES_MM = (50.0, 150.0, 250.0, 400.0, 700.0)
_STRONG = 0.9


def calibration_result(result: from_images.CalibrationResult, version: str) -> CalibrationResult:
    """Return the contract model of a calibration; numbers that are not determined are null.

    Parameters
    ----------
    result
        The library's result.
    version
        Version of Spinewatch, stored with it.

    Returns
    -------
    CalibrationResult
        The rig and its quality.
    """
    calibration = result.calibration
    return CalibrationResult.model_validate(
        {
            "rig": Rig.of(calibration.rig),
            "control_field": ControlField(name=result.field.name, points=len(result.field)),
            "cameras": CameraQualityPair(left=_camera(result, "left"), right=_camera(result, "right")),
            "correlations_above_0.9": _correlations(result),
            "geometry": StereoGeometry.model_validate(result.geometry),
            "limits": _limits(result),
            "shots": _shots(result),
            "leave_one_out": None
            if result.leave_one_out is None
            else ControlAccuracy.of(result.leave_one_out),
            "angles_on_board": _sizes(result),
            "disparity": _disparity(result),
            "removed": _removed(result),
            "flags": Flag.of(calibration.flags),
            "version": version,
        }
    )


def _camera(result: from_images.CalibrationResult, side: str) -> CameraQuality:
    calibration = result.calibration
    free, camera = calibration.free[side], getattr(calibration.rig, side)
    limits = DeterminabilityParameters().max_sd(Sensor.of_camera(camera), camera.focal_length_mm)
    return CameraQuality(
        free=list(free),
        sd=dict(calibration.sd[side]),
        sd_limits={name: limit for name, limit in limits.items() if name in free},
        image_rms_px=calibration.rms_px[side],
        points=sum(len(getattr(shot, side)) for shot in calibration.without_blunders()),
    )


def _limits(result: from_images.CalibrationResult) -> FitLimits:
    calibration = result.calibration
    limits = fit_limits(calibration.rig, calibration.without_blunders(), CalibrationLimits())
    return FitLimits(**asdict(limits), reference_sd_mm=list(TABLE_3_4_SD_MM))


def _correlations(result: from_images.CalibrationResult) -> list[Correlation]:
    names = [_long_name(n) for n in result.calibration.adjustment.names]
    C = result.calibration.adjustment.correlation
    if not np.all(np.isfinite(C)):
        return []
    i, j = np.nonzero(np.triu(np.abs(C) > _STRONG, k=1))
    return [
        Correlation(between=[names[a], names[b]], correlation=float(C[a, b]))
        for a, b in zip(i, j, strict=True)
    ]


def _long_name(name: str) -> str:
    owner, _, parameter = name.partition(":")
    return f"{SIDES[int(owner)]} {parameter}" if owner.isdigit() else f"{owner} {parameter}"


def _shots(result: from_images.CalibrationResult) -> list[ShotQuality]:
    residuals = result.calibration.adjustment.residuals_px
    shots = (*result.calibration.shots, *result.held_out)
    out = []
    for s, (shot, accuracy) in enumerate(zip(shots, result.accuracy, strict=True)):
        left, right = (rms(residuals[c, s]) if (c, s) in residuals else None for c in range(len(SIDES)))
        out.append(
            ShotQuality(
                **dict(ControlAccuracy.of(accuracy)),
                points=ImagePointPair(left=_points(result, shot, s, 0), right=_points(result, shot, s, 1)),
                image_rms_left_px=left,
                image_rms_right_px=right,
            )
        )
    return out


def _points(result: from_images.CalibrationResult, shot: Shot, s: int, camera: int) -> list[ImagePoint]:
    """Return the image points of one side, with the residuals of those that were adjusted."""
    image: ImagePoints = getattr(shot, SIDES[camera])
    adjustment = result.calibration.adjustment
    adjusted = adjustment.block.images.get((camera, s))
    residual: dict[str, list[float]] = {}
    if adjusted is not None:
        residual = dict(zip(adjusted.ids, adjustment.residuals_px[camera, s].tolist(), strict=True))
    return [
        ImagePoint(id=id_, u_px=u, v_px=v, residual_px=residual.get(id_))
        for id_, (u, v) in zip(image.ids, image.pixels.tolist(), strict=True)
    ]


def _sizes(result: from_images.CalibrationResult) -> list[SizeAccuracy]:
    shots = (*result.calibration.without_blunders(), *result.held_out)
    pairs = [
        (a.residuals_mm, common_points(s)[1])
        for a, s in zip(result.accuracy, shots, strict=True)
        if len(a.ids) > 2
    ]
    if not pairs:
        return []
    residuals, control = zip(*pairs, strict=True)
    return [
        SizeAccuracy(
            size_mm=e.size_mm,
            distance_rms_mm=e.distance_rms_mm,
            angle_rms_deg=e.angle_rms_deg,
            measurements=e.n_angles,
        )
        for e in size_accuracy(residuals, control, _SIZE_CLASSES_MM)
    ]


def _removed(result: from_images.CalibrationResult) -> list[RemovedPoint]:
    shots = result.calibration.shots
    return [
        RemovedPoint(side=SIDES[b.camera], shot=shots[b.shot].name, id=b.id, residual_px=b.residual_px)
        for b in result.calibration.blunders
    ]


def _disparity(result: from_images.CalibrationResult) -> Disparity | None:
    z = result.field.points_mm[:, 2]
    try:
        grid = disparity_grid(result.calibration.rig, (float(z.min()), float(z.max())))
    except ParameterError:
        return None
    u, v = grid.bounds_px()
    mean, sd = grid.distribution()
    return Disparity.model_validate(
        {"z_mm": grid.z_mm, "u_bounds_px": u, "v_bounds_px": v, "mean_px": mean, "sd_px": sd}
    )
