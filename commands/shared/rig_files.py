"""Rig files of every format on disk."""

from __future__ import annotations

import os
from pathlib import Path

from commands.shared.files import read_text, write_text
from spinewatch.camera import Rig
from spinewatch.rig_files import RigFormat
from spinewatch.rig_files.formats import (
    EXTRINSICS,
    RIG_FILE_NAMES,
    RigFileContent,
    format_rig_files,
    parse_rig_files,
)


def read_rig_file(
    path: Path,
    rig_format: RigFormat,
    name: str,
    image_size_px: tuple[int, int] | None,
    pixel_size_mm: tuple[float, float],
) -> RigFileContent:
    """Return the rig in a file or folder; of OpenCV's intrinsics.yml with the extrinsics.yml beside it.

    Name, image size and pixel size are used for formats without them.
    """
    texts = {file: read_text(path / file) for file in RIG_FILE_NAMES[rig_format]}
    extrinsics = path.with_name(EXTRINSICS)
    if rig_format == "opencv" and os.path.isfile(extrinsics):
        texts[EXTRINSICS] = read_text(extrinsics)
    return parse_rig_files(
        texts, rig_format, name=name, image_size_px=image_size_px, pixel_size_mm=pixel_size_mm
    )


def write_rig_file(rig: Rig, path: Path, rig_format: RigFormat) -> float:
    """Write a rig to a file or folder; return the maximum error of a fitted distortion model, px."""
    texts, fit_error_px = format_rig_files(rig, rig_format)
    for file, text in texts.items():
        write_text(path / file, text)
    return fit_error_px
