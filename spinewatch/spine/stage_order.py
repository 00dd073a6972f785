"""Which stages the spine of a stage is compared with: the baseline and the stage before."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Comparison:
    """The stages that a stage is compared with.

    Attributes
    ----------
    baseline
        Name of the baseline stage; None while no stage has a pose of the reference triad and none is named.
    previous
        Name of the stage before, of those with a pose of the reference triad; None for the first one.
    """

    baseline: str | None
    previous: str | None


def comparisons(stages: Sequence[tuple[str, bool]], baseline: str | None = None) -> tuple[Comparison, ...]:
    """Return the stages that each stage of a surgery is compared with.

    Parameters
    ----------
    stages
        Name of each measured stage in their order, and whether it has a pose of the reference triad.
    baseline
        Name of the baseline stage; None for the first stage with a pose of the reference triad.

    Returns
    -------
    tuple of Comparison
        One per stage, in the same order.

    Examples
    --------
    >>> [c.previous for c in comparisons([("PRE", True), ("INTER", False), ("POST", True)])]
    [None, 'PRE', 'PRE']
    """
    first = baseline or next((name for name, has_reference in stages if has_reference), None)
    found: list[Comparison] = []
    previous: str | None = None
    for name, has_reference in stages:
        found.append(Comparison(first, previous))
        if has_reference:
            previous = name
    return tuple(found)
