"""The report of a stereo calibration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from reports.camera_table import camera_table
from reports.rendering import render

_SIDES = ("left", "right")
_WIDTH = 420
_MAGNIFICATION = 400


@dataclass(frozen=True)
class _PlottedPoint:
    """An image point of a plot: position and magnified residual, plot units."""

    id: str
    x: float
    y: float
    removed: bool
    residual: tuple[float, float] | None


@dataclass(frozen=True)
class _Plot:
    """The image points of one image, in a plot of the given size."""

    side: str
    width: int
    height: float
    points: Sequence[_PlottedPoint]


def calibration_report(document: Mapping[str, Any]) -> str:
    """Return the report of a stereo calibration.

    Parameters
    ----------
    document
        The calibration document that ``spinewatch calibrate`` prints. ``calibrated_at`` may be None.

    Returns
    -------
    str
        One HTML page that refers to no other file.
    """
    cameras = {side: document["rig"][side] for side in _SIDES}
    accuracy = [*document["shots"], *filter(None, [document["leave_one_out"]])]
    correlations = sorted(document["correlations_above_0.9"], key=lambda entry: -abs(entry["correlation"]))
    return render(
        "calibration.html",
        document=document,
        accuracy=accuracy,
        cameras=camera_table(cameras, document["cameras"]),
        correlations=correlations,
        plots={shot["name"]: [_plot(document, shot, side) for side in _SIDES] for shot in document["shots"]},
        magnification=_MAGNIFICATION,
    )


def _plot(document: Mapping[str, Any], shot: Mapping[str, Any], side: str) -> _Plot:
    width_px, height_px = document["rig"][side]["image_size_px"]
    scale = _WIDTH / width_px
    removed = {(entry["shot"], entry["id"]) for entry in document["removed"] if entry["side"] == side}
    points = [
        _PlottedPoint(
            point["id"],
            point["u_px"] * scale,
            point["v_px"] * scale,
            (shot["name"], point["id"]) in removed,
            _magnified(point.get("residual_px"), scale),
        )
        for point in shot["points"][side]
    ]
    return _Plot(side, _WIDTH, height_px * scale, points)


def _magnified(residual_px: Sequence[float] | None, scale: float) -> tuple[float, float] | None:
    if residual_px is None:
        return None
    du, dv = residual_px
    return _MAGNIFICATION * scale * du, _MAGNIFICATION * scale * dv
