"""The order of vertebrae when only their names are known."""

from __future__ import annotations

from collections.abc import Collection

from spinewatch.levels import anatomical_sequence

_EXTRA_LEVELS = (("T13",), ("L6",), ("S2", "S3", "S4", "S5"))


def sequence_with(names: Collection[str]) -> tuple[str, ...]:
    """Return the vertebrae from the skull down, with those extra levels that names need.

    Parameters
    ----------
    names
        Canonical names of vertebrae.

    Returns
    -------
    tuple of str
        The usual vertebrae, and of the extra ones each that is named or lies above a named one of its region.

    Examples
    --------
    >>> sequence_with(["T12", "S3"])[-4:]
    ('L5', 'S1', 'S2', 'S3')
    """
    return anatomical_sequence(
        [
            level
            for region in _EXTRA_LEVELS
            for number, level in enumerate(region)
            if any(name in names for name in region[number:])
        ]
    )
