"""A calibration's document: the rig, and everything that is known of its quality, ready for JSON."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from spinewatch.calibration.from_images import CalibrationResult
from spinewatch.calibration.points import ImagePoints, Shot
from spinewatch.calibration.quality.accuracy import ShotAccuracy, board_angles, common_points
from spinewatch.calibration.solve.bundle import rms
from spinewatch.calibration.stereo import SIDES
from spinewatch.errors import ParameterError
from spinewatch.planning.disparity import disparity_grid
from spinewatch.rig_files.rig_json import rig_to_dict

_ANGLE_CLASSES_MM = (50.0, 150.0, 250.0, 400.0, 700.0)
_STRONG = 0.9


def calibration_document(result: CalibrationResult) -> dict[str, Any]:
    """Return the document of a result; numbers that are not known are null."""
    calibration = result.calibration
    return {
        "rig": rig_to_dict(calibration.rig),
        "control_field": {"name": result.field.name, "points": len(result.field)},
        "cameras": {side: _camera(result, side) for side in SIDES},
        "correlations_above_0.9": _correlations(result),
        "geometry": _geometry(result),
        "shots": _shots(result),
        "leave_one_out": None if result.left_out is None else _accuracy(result.left_out),
        "angles_on_board": _angles(result),
        "disparity": _disparity(result),
        "removed": [
            {"side": r.side, "shot": r.shot, "id": r.id, "miss_px": r.miss_px} for r in calibration.removed
        ],
        "flags": [{"code": f.code, "detail": f.detail} for f in calibration.flags],
    }


def _camera(result: CalibrationResult, side: str) -> dict[str, Any]:
    calibration = result.calibration
    return {
        "free": list(calibration.free[side]),
        "sd": {name: number(v) for name, v in calibration.sd[side].items()},
        "image_rms_px": number(calibration.rms_px[side]),
        "points": sum(len(getattr(shot, side)) for shot in calibration.without_removed()),
    }


def _correlations(result: CalibrationResult) -> list[dict[str, Any]]:
    names = [_spoken(n) for n in result.calibration.adjustment.names]
    C = result.calibration.correlation
    if not np.all(np.isfinite(C)):
        return []
    i, j = np.nonzero(np.triu(np.abs(C) > _STRONG, k=1))
    return [
        {"between": [names[a], names[b]], "correlation": float(C[a, b])} for a, b in zip(i, j, strict=True)
    ]


def _spoken(name: str) -> str:
    owner, _, parameter = name.partition(":")
    return f"{SIDES[int(owner)]} {parameter}" if owner.isdigit() else f"{owner} {parameter}"


def _geometry(result: CalibrationResult) -> dict[str, Any]:
    g = result.geometry
    return {
        "baseline_mm": g.baseline_mm,
        "baseline_sd_mm": number(g.baseline_sd_mm),
        "vergence_deg": g.vergence_deg,
        "vergence_sd_deg": number(g.vergence_sd_deg),
        "range_mm": list(g.range_mm),
        "field_of_view_mm": list(g.field_of_view_mm),
        "depth_of_field_mm": [number(d) for d in g.depth_of_field_mm],
        "f_number": g.f_number,
        "control_depth_mm": g.control_depth_mm,
    }


def _shots(result: CalibrationResult) -> list[dict[str, Any]]:
    calibration = result.calibration
    points = (*calibration.shots, *result.others)
    out = []
    for s, (shot, accuracy) in enumerate(zip(points, result.accuracy, strict=True)):
        entry = _accuracy(accuracy)
        entry["points"] = {side: _points(result, shot, s, c) for c, side in enumerate(SIDES)}
        for c, side in enumerate(SIDES):
            residuals = calibration.adjustment.residuals_px.get((c, s))
            entry[f"image_rms_{side}_px"] = None if residuals is None else number(rms(residuals))
        out.append(entry)
    return out


def _points(result: CalibrationResult, shot: Shot, s: int, camera: int) -> list[dict[str, Any]]:
    """Return the image points of one side, with the residuals of those that were adjusted."""
    image: ImagePoints = getattr(shot, SIDES[camera])
    adjustment = result.calibration.adjustment
    adjusted = adjustment.block.images.get((camera, s))
    residual: dict[str, list[float]] = {}
    if adjusted is not None:
        residual = dict(zip(adjusted.ids, adjustment.residuals_px[camera, s].tolist(), strict=True))
    return [
        {"id": id_, "u_px": float(u), "v_px": float(v)}
        | ({"residual_px": residual[id_]} if id_ in residual else {})
        for id_, (u, v) in zip(image.ids, image.pixels, strict=True)
    ]


def _accuracy(accuracy: ShotAccuracy) -> dict[str, Any]:
    return {
        "name": accuracy.name,
        "used": accuracy.used,
        "reconstructed": len(accuracy.ids),
        "mean_mm": [number(v) for v in accuracy.mean_mm],
        "sd_mm": [number(v) for v in accuracy.sd_mm],
        "residuals_mm": {
            id_: [float(v) for v in r] for id_, r in zip(accuracy.ids, accuracy.residuals_mm, strict=True)
        },
    }


def _angles(result: CalibrationResult) -> list[dict[str, Any]]:
    shots = (*result.calibration.without_removed(), *result.others)
    pairs = [
        (a.residuals_mm, common_points(s)[1])
        for a, s in zip(result.accuracy, shots, strict=True)
        if len(a.ids) > 2
    ]
    if not pairs:
        return []
    residuals, control = zip(*pairs, strict=True)
    return [
        {
            "size_mm": e.size_mm,
            "distance_rms_mm": e.distance_sd_mm,
            "angle_rms_deg": e.angle_sd_deg,
            "measurements": e.count,
        }
        for e in board_angles(residuals, control, _ANGLE_CLASSES_MM)
    ]


def _disparity(result: CalibrationResult) -> dict[str, Any] | None:
    z = result.field.points_mm[:, 2]
    try:
        grid = disparity_grid(result.calibration.rig, (float(z.min()), float(z.max())))
    except ParameterError:
        return None
    u, v = grid.bounds_px()
    mean, sd = grid.distribution()
    return {
        "z_mm": [float(h) for h in grid.z_mm],
        "u_bounds_px": list(u),
        "v_bounds_px": list(v),
        "mean_px": mean.tolist(),
        "sd_px": sd.tolist(),
    }


def number(value: float) -> float | None:
    """Return a float that JSON can hold, None for NaN and infinity."""
    return float(value) if math.isfinite(value) else None
