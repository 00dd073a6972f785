"""The list of vertebrae on a command line."""

from __future__ import annotations

from collections.abc import Sequence

from spinewatch.errors import ParameterError
from spinewatch.levels import extra_level_names, vertebra_names


def parse_labels(labels: str | None, triads: int | None, extra_levels: Sequence[str] = ()) -> tuple[str, ...]:
    """Return the vertebrae in a comma-separated list, in canonical spelling.

    Raises ``LevelError`` if they are unknown, twice or out of order, and ``ParameterError`` if they contradict
    ``triads``.
    """
    if triads is not None and triads < 1:
        raise ParameterError(f"--triads is {triads}; give the number of triads, 1 or more")
    if labels is None:
        return ()
    names = vertebra_names(_split("--labels", labels, "L1,T11,T9,T7"), extra_levels)
    if triads is not None and len(names) != triads:
        raise ParameterError(f"--labels has {len(names)} names but --triads is {triads}; make them agree")
    return names


def parse_extra_levels(levels: str | None) -> tuple[str, ...]:
    """Return the vertebrae in a comma-separated list of extra levels.

    Raises ``LevelError`` if no spine has them, or if one is there twice.
    """
    if levels is None:
        return ()
    return extra_level_names(_split("--extra-levels", levels, "T13,L6"))


def _split(option: str, text: str, example: str) -> tuple[str, ...]:
    names = tuple(name.strip() for name in text.split(","))
    if not all(names):
        raise ParameterError(f"{option} {text!r} has an empty name; write it like {example}")
    return names
