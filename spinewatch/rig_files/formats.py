"""The rig file formats by name, and conversion between a rig and the texts of its files."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

from spinewatch.camera import Rig
from spinewatch.errors import RigError
from spinewatch.rig_files import RigFormat
from spinewatch.rig_files.opencv_yaml import format_opencv, parse_opencv
from spinewatch.rig_files.openptv import format_openptv, glass_warning, parse_openptv
from spinewatch.rig_files.rig_json import parse_rig, rig_from_dict, rig_to_dict
from spinewatch.rig_files.thesis_1995 import format_1995, parse_1995
from spinewatch.rig_plausibility import SIDES, RigLimits

RIG_FILE_NAMES: Mapping[RigFormat, tuple[str, ...]] = {
    "json": ("",),
    "1995": ("",),
    "opencv": ("",),
    "openptv": ("left.ori", "left.addpar", "right.ori", "right.addpar"),
}
"""Names of the files of a rig in its folder; the empty name stands for a format of one file."""


EXTRINSICS = "extrinsics.yml"
"""Name of the file with R and T, which OpenCV's stereo_calib writes beside intrinsics.yml."""

CART_IMAGE_SIZE_PX = (568, 416)

_MAX_FIT_ERROR_PX = RigLimits().max_fit_error_px
_DISTORTION_FIELDS: Mapping[RigFormat, str] = {
    "json": "radial",
    "1995": "K1",
    "opencv": "distortion_coefficients",
    "openptv": "addpar",
}


@dataclass(frozen=True, eq=False)
class RigFileContent:
    """The rig of a file, and what converting it cost.

    Attributes
    ----------
    rig
        The rig.
    fit_error_px
        Maximum error over the image of a distortion model that had to be fitted, px; 0 otherwise.
    warnings
        Sentences about content that was ignored.
    """

    rig: Rig
    fit_error_px: float
    warnings: tuple[str, ...] = ()


def parse_rig_files(
    texts: Mapping[str, str],
    rig_format: RigFormat,
    *,
    name: str,
    image_size_px: tuple[int, int] | None,
    pixel_size_mm: tuple[float, float],
) -> RigFileContent:
    """Return the rig of the texts of its files, validated as by `rig_json.rig_from_dict`.

    Parameters
    ----------
    texts
        Text of each file by its name in `RIG_FILE_NAMES`; for OpenCV also that of `EXTRINSICS`, if there is one.
    rig_format
        Format of the files.
    name
        Name of the rig, for formats without one.
    image_size_px
        (W, H), px, for formats without it; None for the cart's, except for OpenCV's intrinsics.yml, which needs it.
    pixel_size_mm
        (px, py), mm, for formats without it; OpenCV's format has only the ratio of the two.

    Returns
    -------
    RigFileContent
        The rig.

    Raises
    ------
    RigError
        If a file does not describe a camera, the rig is implausible, or its distortion cannot be carried over within
        0.05 px over the image.

    Examples
    --------
    >>> from spinewatch.simulation.rigs import large_rig
    >>> texts, _ = format_rig_files(large_rig(), "1995")
    >>> content = parse_rig_files(
    ...     texts, "1995", name="again", image_size_px=(568, 416), pixel_size_mm=(0.01, 0.00845)
    ... )
    >>> round(content.rig.baseline_mm, 6)
    420.0
    """
    texts = {file: text.removeprefix("\ufeff") for file, text in texts.items()}
    size = CART_IMAGE_SIZE_PX if image_size_px is None else image_size_px
    fit_error_px = 0.0
    warnings: tuple[str, ...] = ()
    if rig_format == "json":
        return RigFileContent(parse_rig(texts[""]), fit_error_px)
    if rig_format == "openptv":
        (left, left_px), (right, right_px) = (
            parse_openptv(texts[f"{side}.ori"], texts[f"{side}.addpar"], size, pixel_size_mm)
            for side in SIDES
        )
        rig, fit_error_px = Rig(name, left, right), max(left_px, right_px)
        found = {side: glass_warning(texts[f"{side}.ori"]) for side in SIDES}
        warnings = tuple(f"{side}.ori: {text}" for side, text in found.items() if text is not None)
    elif rig_format == "opencv":
        rig, fit_error_px = parse_opencv(
            texts[""], name, pixel_size_mm[0], extrinsics=texts.get(EXTRINSICS), image_size_px=image_size_px
        )
    else:
        rig, fit_error_px = parse_1995(texts[""], name, size, pixel_size_mm)
    _check_fit(fit_error_px, rig_format)
    return RigFileContent(rig_from_dict(rig_to_dict(rig)), fit_error_px, warnings)


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

    Raises
    ------
    RigError
        If the distortion cannot be carried over within 0.05 px over the image.
    """
    if rig_format == "openptv":
        left, right = format_openptv(rig.left), format_openptv(rig.right)
        texts = dict(zip(RIG_FILE_NAMES[rig_format], (*left[:2], *right[:2]), strict=True))
        fit_error_px = max(left[2], right[2])
        _check_fit(fit_error_px, rig_format)
        return texts, fit_error_px
    if rig_format == "opencv":
        text, fit_error_px = format_opencv(rig)
        _check_fit(fit_error_px, rig_format)
        return {"": text}, fit_error_px
    if rig_format == "1995":
        text, fit_error_px = format_1995(rig)
        _check_fit(fit_error_px, rig_format)
        return {"": text}, fit_error_px
    return {"": json.dumps(rig_to_dict(rig), indent=2) + "\n"}, 0.0


def _check_fit(fit_error_px: float, rig_format: RigFormat) -> None:
    """Raise RigError for a fitted distortion that differs from the given one."""
    if not fit_error_px <= _MAX_FIT_ERROR_PX:
        raise RigError(
            _DISTORTION_FIELDS[rig_format],
            "is a distortion that cannot be carried over: the nearest of the other model differs by up to"
            f" {fit_error_px:.3g} px over the image, more than {_MAX_FIT_ERROR_PX:g}; calibrate with fewer"
            " coefficients, or here with `spinewatch calibrate`",
        )
