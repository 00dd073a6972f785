"""Options that describe a camera and its calibration, shared by ``calibrate`` and ``convert``."""

from __future__ import annotations

from spinewatch.calibration.files import solve_parameters
from spinewatch.calibration.points import Sensor
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.errors import ParameterError
from spinewatch.numbers import parse_number

_LARGEST = 1e5


def parse_sensor(image_size: str | None, pixel_size: str | None) -> Sensor:
    """Return the sensor given by --image-size and --pixel-size, by default with the cart's pixels."""
    if image_size is None:
        raise ParameterError("give --image-size, like 568x416: the points do not contain it")
    width, height = two_numbers(image_size, "x", "--image-size", (1, 20_000))
    size = (int(width), int(height))
    pixel_mm = parse_pixel_size(pixel_size)
    return Sensor.of_cart(size) if pixel_mm is None else Sensor(size, pixel_mm)


def parse_pixel_size(pixel_size: str | None) -> tuple[float, float] | None:
    """Return the width and height of a pixel given by --pixel-size, mm, or None without the option."""
    return None if pixel_size is None else two_numbers(pixel_size, ",", "--pixel-size")


def parse_solve_options(free: str | None, fix: str | None, estimate_aspect: bool) -> SolveParameters:
    """Return the parameters given by --free, --fix and --estimate-aspect."""
    names = None if free is None else [name.strip() for name in free.split(",")]
    fixed = dict(_fixed_parameter(item) for item in fix.split(",")) if fix else {}
    return solve_parameters(names, fixed, estimate_aspect)


def two_numbers(
    text: str, separator: str, option: str, bounds: tuple[float, float] = (1e-6, _LARGEST)
) -> tuple[float, float]:
    """Return the two numbers of an option, each within the bounds; raises ``ParameterError``."""
    low, high = bounds
    try:
        a, b = (parse_number(part) for part in text.lower().split(separator))
    except ValueError as error:
        raise ParameterError(
            f"{option} {text!r} must be two numbers separated by {separator!r}, each from {low:g} to {high:g}"
        ) from error
    if not (low <= a <= high and low <= b <= high):
        raise ParameterError(f"{option} {text!r} must be two numbers from {low:g} to {high:g}")
    return a, b


def _fixed_parameter(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        number = parse_number(value)
        if not abs(number) <= _LARGEST:
            raise ValueError("not a number that a parameter can have")
        return name.strip(), number
    except ValueError as error:
        raise ParameterError(f"--fix {text!r} is not NAME=NUMBER, like x0=0") from error
