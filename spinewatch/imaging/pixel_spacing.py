"""Pixel spacing of radiographs: its range, and where it comes from."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

MIN_SPACING_MM, MAX_SPACING_MM = 0.01, 5.0
"""Range of the pixel spacing of radiographs, mm."""
LARGEST_SPACING_RATIO = 2.0
"""Greatest ratio of the distances of rows and columns, either to the other."""


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
        The same; None unless they are two numbers from `MIN_SPACING_MM` to `MAX_SPACING_MM`, whose ratio is at most
        `LARGEST_SPACING_RATIO`.

    Examples
    --------
    >>> plausible_spacing([0.143, 0.143])
    (0.143, 0.143)
    >>> plausible_spacing([0.0, 0.143]) is None
    True
    """
    if not _within_range(numbers) or are_unequal_spacings(numbers):
        return None
    row, column = numbers
    return row, column


def are_unequal_spacings(numbers: Sequence[float]) -> bool:
    """Return whether two distances within the range differ too much to be those of rows and columns.

    Parameters
    ----------
    numbers
        Distances of rows and of columns, mm.

    Returns
    -------
    bool
        Whether one exceeds `LARGEST_SPACING_RATIO` times the other; False for numbers beyond the range.

    Examples
    --------
    >>> are_unequal_spacings([0.1, 0.3]), are_unequal_spacings([0.1, 0.15])
    (True, False)
    """
    return _within_range(numbers) and max(numbers) > LARGEST_SPACING_RATIO * min(numbers)


def _within_range(numbers: Sequence[float]) -> bool:
    return len(numbers) == 2 and all(MIN_SPACING_MM <= number <= MAX_SPACING_MM for number in numbers)
