"""Progress of long work."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]
"""Called at the start of each step with its name and the fraction of the work done before it, 0 to 1."""


def part(progress: Progress, first: float, last: float) -> Progress:
    """Return the progress of a part of the work.

    Parameters
    ----------
    progress
        Progress of the whole work.
    first, last
        Fractions of it at which the part begins and ends, 0 to 1.

    Returns
    -------
    Progress
        Reports to ``progress``.

    Examples
    --------
    >>> part(lambda step, fraction: print(step, fraction), 0.5, 0.75)("adjust", 0.5)
    adjust 0.625
    """
    return lambda step, fraction: progress(step, first + fraction * (last - first))


def silent(step: str, fraction: float) -> None:
    """Report no progress.

    Parameters
    ----------
    step
        Name of the step that begins.
    fraction
        Fraction of the work done before it, 0 to 1.
    """
