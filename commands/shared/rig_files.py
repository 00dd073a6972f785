"""Rigs in files of every format, each with the largest error in px of a distortion that had to be fitted."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Literal

from commands.shared.files import read_text, write_text
from spinewatch.calibration.points import Sensor
from spinewatch.camera import Rig
from spinewatch.rig_files.opencv_yaml import parse_opencv, write_opencv
from spinewatch.rig_files.openptv import parse_openptv, write_openptv
from spinewatch.rig_files.rig_json import parse_rig, rig_to_dict
from spinewatch.rig_files.thesis_1995 import parse_1995, write_1995

Format = Literal["json", "1995", "opencv", "openptv"]
_SIDES = ("left", "right")


def read_rig_file(path: Path, file_format: Format, sensor: Sensor, name: str) -> tuple[Rig, float]:
    """Return the rig of a file, or of OpenPTV's folder; ``sensor`` and ``name`` are for formats without them."""
    if file_format == "json":
        return parse_rig(read_text(path)), 0.0
    if file_format == "1995":
        return parse_1995(read_text(path), name, sensor.image_size_px, sensor.pixel_size_mm), 0.0
    if file_format == "opencv":
        return parse_opencv(read_text(path), name, sensor.pixel_size_mm[0])
    (left, a), (right, b) = (
        parse_openptv(
            read_text(path / f"{side}.ori"),
            read_text(path / f"{side}.addpar"),
            sensor.image_size_px,
            sensor.pixel_size_mm,
        )
        for side in _SIDES
    )
    return Rig(name, left, right), max(a, b)


def write_rig_file(rig: Rig, path: Path, file_format: Format) -> float:
    """Write a rig to a file, or to OpenPTV's folder; return the largest error of the fitted distortion, px."""
    if file_format == "json":
        write_text(path, json.dumps(rig_to_dict(rig), indent=2) + "\n")
        return 0.0
    if file_format == "1995":
        write_text(path, write_1995(rig))
        return 0.0
    if file_format == "opencv":
        text, error = write_opencv(rig)
        write_text(path, text)
        return error
    errors = []
    for side in _SIDES:
        ori, addpar, error = write_openptv(getattr(rig, side))
        write_text(path / f"{side}.ori", ori)
        write_text(path / f"{side}.addpar", addpar)
        errors.append(error)
    return max(errors)
