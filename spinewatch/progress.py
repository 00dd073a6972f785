"""Progress of long work."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float], None]
"""Called at the start of each step with its name and the fraction of the work done before it, 0 to 1."""


def silent(step: str, fraction: float) -> None:
    """Report no progress.

    Parameters
    ----------
    step
        Name of the step that begins.
    fraction
        Fraction of the work done before it, 0 to 1.
    """
