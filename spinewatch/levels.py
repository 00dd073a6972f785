"""Vertebrae: their names, in order from the skull to the sacrum."""

from __future__ import annotations

import re
from collections.abc import Sequence

from spinewatch.errors import ParameterError

_REGIONS = {"C": (7, 7), "T": (12, 13), "L": (5, 6), "S": (1, 5)}
"""Vertebrae of each region that everybody has, and with those that can be declared."""

_NAME = re.compile(r"([CTLS])0*([1-9]\d?)", re.ASCII)
_SHOWN = re.compile(r"[A-Za-z0-9]{1,3}", re.ASCII)


class LevelError(ParameterError):
    """Names of vertebrae that are unknown, given twice or not in anatomical order.

    Parameters
    ----------
    problem
        What is wrong and what to do.
    index
        Number of the offending name, from 0, if it is one.
    """

    code = "invalid-levels"

    def __init__(self, problem: str, index: int | None = None) -> None:
        super().__init__(problem)
        self.index = index


class ExtraLevelError(LevelError):
    """An extra level that no spine has."""


def canonical_name(name: str) -> str:
    """Return a vertebra's name in upper case without leading zeros.

    Parameters
    ----------
    name
        Name in any spelling.

    Returns
    -------
    str
        The canonical name; a name that is no letter with a number is only stripped of spaces.

    Examples
    --------
    >>> canonical_name(" t09 ")
    'T9'
    """
    match = _NAME.fullmatch(name.strip().upper())
    return match[1] + match[2] if match else name.strip()


def anatomical_sequence(extra_levels: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the names of all vertebrae from the skull down: C1 to C7, T1 to T12, L1 to L5, S1 and the extra ones.

    Parameters
    ----------
    extra_levels
        Vertebrae that this spine has in addition: T13, L6, or S2 to S5, each only with those above it.

    Returns
    -------
    tuple of str
        Canonical names.

    Raises
    ------
    ExtraLevelError
        If an extra level does not continue its region.

    Examples
    --------
    >>> anatomical_sequence(["L6"])[-3:]
    ('L5', 'L6', 'S1')
    """
    extra = [canonical_name(name) for name in extra_levels]
    sequence: list[str] = []
    for letter, (usual, most) in _REGIONS.items():
        number = 1
        while number <= usual or (number <= most and f"{letter}{number}" in extra):
            sequence.append(f"{letter}{number}")
            number += 1
    for index, name in enumerate(extra):
        if name not in sequence:
            raise ExtraLevelError(
                f"extra level {_shown(name, index)} does not continue T12, L5 or S1; T13, L6 and S2 to S5 can be"
                " declared",
                index,
            )
    return tuple(sequence)


def extra_level_names(levels: Sequence[str]) -> tuple[str, ...]:
    """Return declared extra levels in canonical spelling after checking them.

    Parameters
    ----------
    levels
        Vertebrae that a spine has in addition, in any spelling.

    Returns
    -------
    tuple of str
        Canonical names.

    Raises
    ------
    ExtraLevelError
        If an extra level does not continue its region, or is given twice.

    Examples
    --------
    >>> extra_level_names(["t13", "L06"])
    ('T13', 'L6')
    """
    names = tuple(canonical_name(level) for level in levels)
    anatomical_sequence(names)
    for index, name in enumerate(names):
        if name in names[:index]:
            raise ExtraLevelError(f"extra level {name} is named twice; name each once", index)
    return names


def vertebra_names(names: Sequence[str], extra_levels: Sequence[str] = ()) -> tuple[str, ...]:
    """Return names of vertebrae in canonical spelling after checking them.

    Parameters
    ----------
    names
        Names in anatomical order, downwards or upwards, in any spelling.
    extra_levels
        Vertebrae that this spine has in addition, for example T13 or L6.

    Returns
    -------
    tuple of str
        Canonical names in the order that was given.

    Raises
    ------
    LevelError
        If a name is not one of the sequence, is given twice, or is out of order.

    Examples
    --------
    >>> vertebra_names(["l1", "T11", "T09"])
    ('L1', 'T11', 'T9')
    """
    found = tuple(canonical_name(name) for name in names)
    numbers = level_numbers(found, extra_levels)
    for name in found:
        if found.count(name) > 1:
            raise LevelError(f"vertebra {name} is named twice; name each once")
    downwards = [name for _, name in sorted(zip(numbers, found, strict=True))]
    if list(found) not in (downwards, downwards[::-1]):
        raise LevelError(
            f"{','.join(found)} is not in the order of the spine; name the vertebrae along it,"
            f" {','.join(downwards)} or reversed"
        )
    return found


def level_numbers(names: Sequence[str], extra_levels: Sequence[str] = ()) -> tuple[int, ...]:
    """Return the places of vertebrae in the anatomical sequence.

    Parameters
    ----------
    names
        Canonical names.
    extra_levels
        Vertebrae that this spine has in addition.

    Returns
    -------
    tuple of int
        Number of vertebrae above each.

    Raises
    ------
    LevelError
        If a name is not one of the sequence.
    """
    sequence = anatomical_sequence(extra_levels)
    for index, name in enumerate(names):
        if name not in sequence:
            raise LevelError(
                f"{_shown(name, index)} is not a vertebra of C1 to C7, T1 to T12, L1 to L5 and S1; correct the name, or"
                " declare T13, L6 or S2 to S5 as an extra level",
                index,
            )
    return tuple(sequence.index(name) for name in names)


def _shown(name: str, index: int) -> str:
    """Return a name, or its number if it has not the length of one: messages do not repeat other input."""
    return name if _SHOWN.fullmatch(name) else f"number {index + 1}"
