"""Shoot and calibrate from files: from the bytes of pictures to the calibration document.

The command line and the workers share this, so that a calibration is the same whichever way it was asked for.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from contract.calibration_documents import calibration_document
from spinewatch.arrays import Pixels
from spinewatch.calibration.control_field import BUILT_IN, ControlField
from spinewatch.calibration.errors import ControlFieldError
from spinewatch.calibration.from_images import FromImagesParameters, calibrate_from_images
from spinewatch.calibration.point_tables import built_in_field, parse_control_field
from spinewatch.calibration.solve.collinearity import EXTERIOR, NAMES
from spinewatch.calibration.solve.resection import SolveParameters
from spinewatch.errors import ImageError, ParameterError, SameImageError
from spinewatch.imaging.decoding import decode_image
from spinewatch.progress import Progress, silent


@dataclass(frozen=True)
class ShotFiles:
    """The files of one stereo pair of the control field, and what to call it."""

    name: str
    left: bytes
    right: bytes


def calibrate_files(
    shots: Sequence[ShotFiles],
    field: ControlField,
    parameters: FromImagesParameters | None = None,
    progress: Progress = silent,
    *,
    verify: int = 0,
    rig_name: str = "rig",
) -> dict[str, Any]:
    """Return the document (``calibration_json``) of the calibration that ``calibrate_from_images`` makes.

    Raises as that does, ``ImageError`` naming the file that is no picture, and ``SameImageError`` when a picture
    is given twice: a shot that verifies itself would look better than it is.
    """
    progress("decode", 0.0)
    _refuse_twice(shots)
    pairs = [(_picture(shot, "left"), _picture(shot, "right")) for shot in shots]
    names = [shot.name for shot in shots]
    result = calibrate_from_images(
        pairs, field, parameters, progress, names=names, verify=verify, rig_name=rig_name
    )
    return calibration_document(result)


def control_field(name: str, points_csv: str | None = None) -> ControlField:
    """Return the control field of a CSV, or without one the built-in field of that name."""
    if points_csv is not None:
        return parse_control_field(points_csv, name)
    field = built_in_field(name)
    if field is None:
        raise ControlFieldError(
            f"{name!r} is no built-in control field; choose from {', '.join(BUILT_IN)}, or give a CSV"
            " id,x_mm,y_mm,z_mm"
        )
    return field


def solve_parameters(
    free: Sequence[str] | None, fixed: Mapping[str, float], estimate_aspect: bool
) -> SolveParameters:
    """Return how to solve with these interior parameters free, or held; raise ``ParameterError`` for a wrong name."""
    for name in (*(free or ()), *fixed):
        if name not in NAMES:
            raise ParameterError(
                f"{name!r} is not a camera parameter; choose from {', '.join(NAMES[len(EXTERIOR) :])}"
            )
    names = None if free is None else (*EXTERIOR, *(name for name in free if name not in EXTERIOR))
    return SolveParameters(free=names, fixed=dict(fixed), estimate_aspect=estimate_aspect)


def _refuse_twice(shots: Sequence[ShotFiles]) -> None:
    seen: dict[bytes, str] = {}
    for shot in shots:
        for side, content in (("left", shot.left), ("right", shot.right)):
            where = f"the {side} picture of shot {shot.name}"
            same = seen.setdefault(hashlib.sha256(content).digest(), where)
            if same != where:
                raise SameImageError(f"{where} is also {same}; give each picture once")


def _picture(shot: ShotFiles, side: str) -> Pixels:
    try:
        return decode_image(shot.left if side == "left" else shot.right)
    except ImageError as error:
        raise ImageError(f"the {side} picture of shot {shot.name}: {error}") from error
