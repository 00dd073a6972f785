"""The rig file formats by name, and conversion between a rig and the texts of its files."""

from __future__ import annotations

import json
from collections.abc import Mapping

from spinewatch.camera import Rig
from spinewatch.rig_files import RigFormat
from spinewatch.rig_files.opencv_yaml import format_opencv, parse_opencv
from spinewatch.rig_files.openptv import format_openptv, parse_openptv
from spinewatch.rig_files.rig_json import parse_rig, rig_to_dict
from spinewatch.rig_files.thesis_1995 import format_1995, parse_1995

RIG_FILE_NAMES: Mapping[RigFormat, tuple[str, ...]] = {
    "json": ("",),
    "1995": ("",),
    "opencv": ("",),
    "openptv": ("left.ori", "left.addpar", "right.ori", "right.addpar"),
}
"""Names of the files of a rig in its folder; the empty name stands for a format of one file."""


def parse_rig_files(
    texts: Mapping[str, str],
    rig_format: RigFormat,
    *,
    name: str,
    image_size_px: tuple[int, int],
    pixel_size_mm: tuple[float, float],
) -> tuple[Rig, float]:
    """Return the rig of the texts of its files.

    Parameters
    ----------
    texts
        Text of each file by its name in `RIG_FILE_NAMES`.
    rig_format
        Format of the files.
    name
        Name of the rig, for formats without one.
    image_size_px
        (W, H), px, for formats without it.
    pixel_size_mm
        (px, py), mm, for formats without it; OpenCV's format has only the ratio of the two.

    Returns
    -------
    rig : Rig
        The rig.
    fit_error_px : float
        Maximum error over the image of a distortion model that had to be fitted, px; 0 otherwise.

    Raises
    ------
    RigError
        If a file does not describe a camera.

    Examples
    --------
    >>> from spinewatch.simulation.rigs import large_rig
    >>> texts, _ = format_rig_files(large_rig(), "1995")
    >>> rig, _ = parse_rig_files(
    ...     texts, "1995", name="again", image_size_px=(568, 416), pixel_size_mm=(0.01, 0.00845)
    ... )
    >>> round(rig.baseline_mm, 6)
    420.0
    """
    if rig_format == "openptv":
        left, right = (
            parse_openptv(texts[f"{side}.ori"], texts[f"{side}.addpar"], image_size_px, pixel_size_mm)
            for side in ("left", "right")
        )
        return Rig(name, left[0], right[0]), max(left[1], right[1])
    text = texts[""]
    if rig_format == "opencv":
        return parse_opencv(text, name, pixel_size_mm[0])
    if rig_format == "1995":
        return parse_1995(text, name, image_size_px, pixel_size_mm), 0.0
    return parse_rig(text), 0.0


def format_rig_files(rig: Rig, rig_format: RigFormat) -> tuple[dict[str, str], float]:
    """Return the texts of the files of a rig.

    Parameters
    ----------
    rig
        The rig.
    rig_format
        Format of the files.

    Returns
    -------
    texts : dict
        Text of each file by its name in `RIG_FILE_NAMES`.
    fit_error_px : float
        Maximum error over the image of a distortion model that had to be fitted, px; 0 otherwise.
    """
    if rig_format == "openptv":
        left, right = format_openptv(rig.left), format_openptv(rig.right)
        texts = dict(zip(RIG_FILE_NAMES[rig_format], (*left[:2], *right[:2]), strict=True))
        return texts, max(left[2], right[2])
    if rig_format == "opencv":
        text, fit_error_px = format_opencv(rig)
        return {"": text}, fit_error_px
    if rig_format == "1995":
        return {"": format_1995(rig)}, 0.0
    return {"": json.dumps(rig_to_dict(rig), indent=2) + "\n"}, 0.0
