"""Any number of calibrated cameras as JSON: ``{"cameras": [{"name": ..., and a camera as in a rig}]}``."""

from __future__ import annotations

from typing import Any

import numpy as np

from contract.calibration_documents import number
from spinewatch.calibration.cameras import CalibratedCameras
from spinewatch.calibration.quality.accuracy import ShotAccuracy
from spinewatch.calibration.solve.bundle import rms
from spinewatch.rig_files.rig_json import camera_to_dict


def cameras_to_dict(result: CalibratedCameras) -> dict[str, Any]:
    """Return the cameras alone; any two of them make a rig JSON."""
    return {"cameras": [{"name": name, **camera_to_dict(c)} for name, c in result.cameras.items()]}


def cameras_document(result: CalibratedCameras) -> dict[str, Any]:
    """Return the cameras and everything that is known of their quality; numbers that are not known are null."""
    return {
        **cameras_to_dict(result),
        "shots": list(result.shots),
        "quality": {name: _quality(result, c, name) for c, name in enumerate(result.cameras)},
        "pairs": [
            {"cameras": list(names), "shots": [_accuracy(a) for a in found]}
            for names, found in result.pairs.items()
        ],
        "removed": [
            {"camera": r.side, "shot": r.shot, "id": r.id, "miss_px": r.miss_px} for r in result.removed
        ],
        "flags": [{"code": f.code, "detail": f.detail} for f in result.flags],
    }


def _quality(result: CalibratedCameras, c: int, name: str) -> dict[str, Any]:
    adjustment = result.adjustment
    residuals = [r for (camera, _), r in adjustment.residuals_px.items() if camera == c]
    return {
        "free": list(adjustment.block.free[c]),
        "sd": {key: number(v) for key, v in result.sd(name).items()},
        "image_rms_px": number(rms(np.concatenate(residuals))),
        "points": sum(map(len, residuals)),
    }


def _accuracy(a: ShotAccuracy) -> dict[str, Any]:
    return {"name": a.name, "reconstructed": len(a.ids), "sd_mm": [number(v) for v in a.sd_mm]}
