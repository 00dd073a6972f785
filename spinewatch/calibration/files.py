"""Calibration from the contents of files, shared by the command line and the workers."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from spinewatch.arrays import Pixels
from spinewatch.calibration.boards import board_field, is_board
from spinewatch.calibration.control_field import ControlField, built_in_field
from spinewatch.calibration.from_images import CalibrationParameters, CalibrationResult, calibrate_from_images
from spinewatch.calibration.point_tables import parse_control_field
from spinewatch.calibration.solve.collinearity import EXTERIOR_NAMES, PARAMETER_NAMES
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.errors import ImageError, ParameterError, SameImageError
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import SIDES
from spinewatch.progress import Progress, silent


@dataclass(frozen=True)
class ShotFiles:
    """The image files of one stereo pair of the control field.

    Attributes
    ----------
    name
        Name of the shot.
    left, right
        Contents of the files.
    """

    name: str
    left: bytes
    right: bytes


def calibrate_files(
    shots: Sequence[ShotFiles],
    field: ControlField,
    parameters: CalibrationParameters | None = None,
    progress: Progress = silent,
    *,
    verify: int = 0,
    rig_name: str = "rig",
) -> CalibrationResult:
    """Return the rig that took images of a control field, from their files.

    Parameters
    ----------
    shots
        Files of each shot; the first defines object space.
    field
        The control field.
    parameters
        Parameters of all steps.
    progress
        Called at the start of each step.
    verify
        Number of trailing shots held out for verification.
    rig_name
        Name of the rig.

    Returns
    -------
    CalibrationResult
        As `calibrate_from_images`.

    Raises
    ------
    ImageError
        If a file is no image; the message names it.
    SameImageError
        If an image is given twice: a shot that is both adjusted and held out would verify itself.
    CalibrationError
        If no calibration can be made.
    """
    progress("decode", 0.0)
    _check_distinct(shots)
    pairs = [
        (_decode(shot.left, shot.name, SIDES[0]), _decode(shot.right, shot.name, SIDES[1])) for shot in shots
    ]
    names = [shot.name for shot in shots]
    return calibrate_from_images(
        pairs, field, parameters, progress, names=names, verify=verify, rig_name=rig_name
    )


def load_control_field(name: str, points_csv: str | None = None) -> ControlField:
    """Return a control field by its name or from a CSV.

    Parameters
    ----------
    name
        Name of the field.
    points_csv
        CSV ``id,x_mm,y_mm,z_mm``; without it the built-in field of that name is returned.

    Returns
    -------
    ControlField
        The field.

    Raises
    ------
    ControlFieldError
        If the CSV cannot be used, or there is no built-in field of that name.

    Examples
    --------
    >>> len(load_control_field("pegboard-1995"))
    30
    """
    if points_csv is not None:
        return parse_control_field(points_csv, name)
    return board_field(name) if is_board(name) else built_in_field(name)


def solve_parameters(
    free: Sequence[str] | None, fixed: Mapping[str, float], estimate_aspect: bool
) -> SolveParameters:
    """Return the parameters of a solution with given interior parameters free or fixed.

    Parameters
    ----------
    free
        Names of the interior parameters to adjust; None to select them automatically.
    fixed
        Values of parameters that are known.
    estimate_aspect
        Whether py/px is adjusted.

    Returns
    -------
    SolveParameters
        The parameters.

    Raises
    ------
    ParameterError
        If a name is not that of a parameter.

    Examples
    --------
    >>> solve_parameters(["f"], {}, False).free
    ('X0', 'Y0', 'Z0', 'omega', 'phi', 'kappa', 'f')
    """
    for name in (*(free or ()), *fixed):
        if name not in PARAMETER_NAMES:
            raise ParameterError(
                f"{name!r} is not a camera parameter; choose from"
                f" {', '.join(PARAMETER_NAMES[len(EXTERIOR_NAMES) :])}"
            )
    names = None if free is None else (*EXTERIOR_NAMES, *(n for n in free if n not in EXTERIOR_NAMES))
    return SolveParameters(free=names, fixed=dict(fixed), estimate_aspect=estimate_aspect)


def _check_distinct(shots: Sequence[ShotFiles]) -> None:
    known: dict[bytes, str] = {}
    for shot in shots:
        for side, content in zip(SIDES, (shot.left, shot.right), strict=True):
            where = f"the {side} image of shot {shot.name}"
            first = known.setdefault(hashlib.sha256(content).digest(), where)
            if first != where:
                raise SameImageError(f"{where} is also {first}; give each image once")


def _decode(content: bytes, shot: str, side: str) -> Pixels:
    try:
        return decode_image(content)
    except ImageError as error:
        raise ImageError(f"the {side} image of shot {shot}: {error}") from error
