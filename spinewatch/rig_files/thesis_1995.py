"""The camera parameter file of 1995, in the form of Table 3.3: one line per camera, angles as DDDMMSS.s.

    LEFT   X0 Y0 Z0  omega phi kappa  f x0 y0  K1 K2 P1 P2

Lengths are mm. Lines that start with # are comments. The file does not describe the sensor. Its distortion is about the
origin of the plate (`plate_origin`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from spinewatch.camera import Camera, Rig
from spinewatch.errors import ParameterError, RigError
from spinewatch.geometry.angles import degrees_from_dms, dms_from_degrees
from spinewatch.numbers import NumberTextError, parse_number
from spinewatch.rig_files.plate_origin import about_plate_origin, about_principal_point
from spinewatch.rig_plausibility import SIDES, is_parallel, sees_common_field, with_angles

_NAMES = ("X0", "Y0", "Z0", "omega", "phi", "kappa", "f", "x0", "y0", "K1", "K2", "P1", "P2")


def parse_1995(
    text: str,
    name: str,
    image_size_px: tuple[int, int] = (568, 416),
    pixel_size_mm: tuple[float, float] = (0.01, 0.00845),
) -> tuple[Rig, float]:
    """Return the rig of a 1995 parameter file.

    Parameters
    ----------
    text
        Text of the file.
    name
        Name of the rig.
    image_size_px
        (W, H), px; by default the cart's.
    pixel_size_mm
        (px, py), mm; by default the cart's.

    Returns
    -------
    rig : Rig
        The rig, with its distortion about the principal point.
    fit_error_px : float
        Maximum error of the converted distortion over the image, px.

    Raises
    ------
    RigError
        If a line is missing, given twice or has a wrong entry, or if the angles are not in DDDMMSS.s.

    References
    ----------
    Thesis Table 3.3.
    """
    cameras: dict[str, Camera] = {}
    for line in text.splitlines():
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        side = words[0].lower()
        if side not in SIDES:
            raise RigError(
                words[0], "is neither LEFT nor RIGHT; start the line of each camera with one of them"
            )
        if side in cameras:
            raise RigError(side, "is given twice; keep one line")
        cameras[side] = _camera(side, words[1:], image_size_px, pixel_size_mm)
    missing = [side for side in SIDES if side not in cameras]
    if missing:
        raise RigError(missing[0], "is missing; a rig has a LEFT and a RIGHT line")
    rig = Rig(name, cameras["left"], cameras["right"])
    _check_packing(rig)
    left, right = about_principal_point(rig.left), about_principal_point(rig.right)
    return Rig(name, left.camera, right.camera), max(left.fit_error_px, right.fit_error_px)


def format_1995(rig: Rig) -> tuple[str, float]:
    """Return the text of a 1995 parameter file.

    Parameters
    ----------
    rig
        The rig.

    Returns
    -------
    text : str
        Text of the file; angles are rounded to some 3e-11 degrees.
    fit_error_px : float
        Maximum error of the converted distortion over the image, px.

    Examples
    --------
    >>> from spinewatch.simulation.rigs import large_rig
    >>> print(format_1995(large_rig())[0][:58])
    # X0 Y0 Z0 omega phi kappa f x0 y0 K1 K2 P1 P2  (mm, DDDMM
    """
    header = "# " + " ".join(_NAMES) + "  (mm, DDDMMSS.s)"
    left, right = about_plate_origin(rig.left), about_plate_origin(rig.right)
    lines = [header, _line("LEFT", left.camera), _line("RIGHT", right.camera)]
    return "\n".join(lines) + "\n", max(left.fit_error_px, right.fit_error_px)


def _camera(side: str, words: list[str], size: tuple[int, int], pixel: tuple[float, float]) -> Camera:
    if len(words) != len(_NAMES):
        raise RigError(side, f"has {len(words)} numbers; Table 3.3 has {len(_NAMES)}: {' '.join(_NAMES)}")
    values = {}
    for key, word in zip(_NAMES, words, strict=True):
        try:
            values[key] = parse_number(word)
        except NumberTextError as error:
            hint = "; write a decimal point" if "," in word else ""
            raise RigError(f"{side}.{key}", f"is {word!r}, which {error}{hint}") from error
    try:
        omega, phi, kappa = (degrees_from_dms(values[key]) for key in ("omega", "phi", "kappa"))
    except ParameterError as error:
        raise RigError(f"{side}.angles", str(error)) from error
    if values["f"] <= 0:
        raise RigError(f"{side}.f", "must be positive")
    v = values
    return Camera(
        (v["X0"], v["Y0"], v["Z0"]),
        (omega, phi, kappa),
        v["f"],
        (v["x0"], v["y0"]),
        (v["K1"], v["K2"]),
        (v["P1"], v["P2"]),
        size,
        pixel,
    )


def _check_packing(rig: Rig) -> None:
    """Raise RigError if the axes are parallel because the angles were not packed as DDDMMSS.s."""
    largest = max(abs(angle) for camera in (rig.left, rig.right) for angle in camera.rotation_deg)
    if not is_parallel(rig) or not largest:
        return
    likely = [
        unit for unit, reading in _OTHER_READINGS.items() if sees_common_field(_read_again(rig, reading))
    ]
    if likely or largest < 1 / 60:
        raise RigError(
            "omega, phi, kappa",
            f"cannot be DDDMMSS.s: as such they make the optical axes parallel within {rig.vergence_deg:.2g} degrees;"
            f" were they written in {likely[0] if likely else 'decimal degrees or radians'}?",
        )


def _read_again(rig: Rig, reading: Callable[[float], float]) -> Rig:
    """Return a rig with another reading of the numbers that were read as DDDMMSS.s."""
    return with_angles(rig, lambda angle: reading(float(dms_from_degrees(angle))))


def _degrees_from_dm(packed: float) -> float:
    """Return the decimal degrees of an angle packed as DDDMM.m."""
    degrees, minutes = divmod(abs(packed), 100)
    return math.copysign(degrees + minutes / 60, packed)


_OTHER_READINGS: Mapping[str, Callable[[float], float]] = {
    "decimal degrees": float,
    "radians": math.degrees,
    "degrees and minutes, DDDMM": _degrees_from_dm,
}
"""Degrees of a number by what a person may have written instead of DDDMMSS.s."""


def _line(side: str, camera: Camera) -> str:
    angles = (dms_from_degrees(a) for a in camera.rotation_deg)
    lens = (camera.focal_length_mm, *camera.principal_point_mm, *camera.radial, *camera.decentering)
    return " ".join([f"{side:5}", *(repr(x) for x in camera.position_mm), *angles, *(repr(x) for x in lens)])
