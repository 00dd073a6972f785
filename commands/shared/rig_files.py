"""Rig files of every format on disk."""

from __future__ import annotations

from pathlib import Path

from commands.shared.files import read_text, write_text
from spinewatch.calibration.points import Sensor
from spinewatch.camera import Rig
from spinewatch.rig_files import RigFormat
from spinewatch.rig_files.formats import RIG_FILE_NAMES, format_rig_files, parse_rig_files


def read_rig_file(path: Path, rig_format: RigFormat, sensor: Sensor, name: str) -> tuple[Rig, float]:
    """Return the rig in a file or folder, and the maximum error of a fitted distortion model, px.

    ``sensor`` and ``name`` are used for formats without them.
    """
    return parse_rig_files(
        {file: read_text(path / file) for file in RIG_FILE_NAMES[rig_format]},
        rig_format,
        name=name,
        image_size_px=sensor.image_size_px,
        pixel_size_mm=sensor.pixel_size_mm,
    )


def write_rig_file(rig: Rig, path: Path, rig_format: RigFormat) -> float:
    """Write a rig to a file or folder; return the maximum error of a fitted distortion model, px."""
    texts, fit_error_px = format_rig_files(rig, rig_format)
    for file, text in texts.items():
        write_text(path / file, text)
    return fit_error_px
