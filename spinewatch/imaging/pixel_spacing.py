"""Pixel spacing of radiographs: its range, and where it comes from."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

MIN_SPACING_MM, MAX_SPACING_MM = 0.01, 5.0
"""Range of the pixel spacing of radiographs, mm."""


class SpacingSource(StrEnum):
    """Where the pixel spacing of a radiograph comes from."""

    GIVEN = "given"
    PIXEL_SPACING = "pixel_spacing"
    IMAGER_PIXEL_SPACING = "imager_pixel_spacing"


def plausible_spacing(numbers: Sequence[float]) -> tuple[float, float] | None:
    """Return a pixel spacing if numbers are one.

    Parameters
    ----------
    numbers
        Distances of rows and of columns, mm.

    Returns
    -------
    tuple of float or None
        The same; None unless they are two numbers from `MIN_SPACING_MM` to `MAX_SPACING_MM`.

    Examples
    --------
    >>> plausible_spacing([0.143, 0.143])
    (0.143, 0.143)
    >>> plausible_spacing([0.0, 0.143]) is None
    True
    """
    if len(numbers) != 2 or not all(MIN_SPACING_MM <= number <= MAX_SPACING_MM for number in numbers):
        return None
    row, column = numbers
    return row, column
