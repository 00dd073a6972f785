"""The table of camera parameters in a report."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from reports.rendering import format_number

_UNITS = {
    "X0": "mm",
    "Y0": "mm",
    "Z0": "mm",
    "omega": "°",
    "phi": "°",
    "kappa": "°",
    "f": "mm",
    "x0": "mm",
    "y0": "mm",
    "K1": "mm⁻²",
    "K2": "mm⁻⁴",
    "P1": "mm⁻¹",
    "P2": "mm⁻¹",
    "aspect": "",
}


@dataclass(frozen=True)
class CameraTable:
    """Parameters of cameras, one column of values and one of standard deviations per camera.

    Attributes
    ----------
    cameras
        Names of the cameras.
    rows
        Label of each row, and per camera a value and its standard deviation, as text.
    """

    cameras: tuple[str, ...]
    rows: tuple[tuple[str, tuple[tuple[str, str], ...]], ...]


def camera_table(cameras: Mapping[str, Any], quality: Mapping[str, Any]) -> CameraTable:
    """Return the table of camera parameters.

    Parameters
    ----------
    cameras
        Cameras as in a rig JSON, by name.
    quality
        ``sd``, ``image_rms_px`` and ``points`` of each camera, by name. A parameter without an entry in ``sd`` was
        held fixed; one whose entry is None is not determined.

    Returns
    -------
    CameraTable
        Exterior and interior parameters, the pixel aspect ratio, the RMS of the image residuals and the number of
        image points.
    """
    values = {name: _parameters(camera) for name, camera in cameras.items()}
    rows = [
        (
            f"{parameter} ({unit})" if unit else parameter,
            tuple((f"{values[n][parameter]:.6g}", _deviation(quality[n]["sd"], parameter)) for n in cameras),
        )
        for parameter, unit in _UNITS.items()
    ]
    rms = tuple((format_number(quality[n]["image_rms_px"], ".3f"), "") for n in cameras)
    points = tuple((str(quality[n]["points"]), "") for n in cameras)
    return CameraTable(tuple(cameras), (*rows, ("image RMS (px)", rms), ("points", points)))


def _parameters(camera: Mapping[str, Any]) -> dict[str, float]:
    px, py = camera["pixel_size_mm"]
    values = [
        *camera["position_mm"],
        *camera["rotation_deg"],
        camera["focal_length_mm"],
        *camera["principal_point_mm"],
        *camera["radial"],
        *camera["decentering"],
        py / px,
    ]
    return dict(zip(_UNITS, values, strict=True))


def _deviation(sd: Mapping[str, float | None], parameter: str) -> str:
    if parameter not in sd:
        return "fixed"
    value = sd[parameter]
    return "undetermined" if value is None else f"{value:.2g}"
