"""Flags of the triads of a pair: hidden balls, centres placed by a person, triads without a pose, and their number."""

from __future__ import annotations

from collections.abc import Sequence

from spinewatch.flags import Flag
from spinewatch.triads.pose import MeasuredTriad

TRIAD_FLAGS = frozenset(
    {
        "ball-occluded",
        "ball-manual",
        "triad-incomplete",
        "triad-doubtful",
        "triad-count-low",
        "triad-count-high",
    }
)
"""Codes of the flags that follow from the triads alone."""


def triad_flags(triads: Sequence[MeasuredTriad], expected: int | None) -> tuple[Flag, ...]:
    """Return the flags of triads.

    Parameters
    ----------
    triads
        The triads in order along the spine.
    expected
        Number of triads placed; None if it is not known.

    Returns
    -------
    tuple of Flag
        "ball-occluded" for each hidden ball, "ball-manual" for each whose centre a person placed, "triad-incomplete"
        or "triad-doubtful" for each triad without a pose, "triad-count-low" or "triad-count-high" for another number
        than expected.

    Examples
    --------
    >>> [flag.code for flag in triad_flags([], 4)]
    ['triad-count-low']
    """
    return (
        *_occlusion_flags(triads),
        *_manual_flags(triads),
        *_pose_flags(triads),
        *_count_flags(triads, expected),
    )


def _occlusion_flags(triads: Sequence[MeasuredTriad]) -> tuple[Flag, ...]:
    """Return a flag for each hidden ball of a triad with a pose."""
    return tuple(
        Flag(
            "ball-occluded",
            f"triad {number} along the spine: ball {name} is hidden in the {' and '.join(ball.hidden_in)} image; the"
            " deviations of the pose are larger",
        )
        for number, triad in enumerate(triads, start=1)
        for name, ball in triad.balls.items()
        if triad.pose is not None and ball.hidden_in
    )


def _manual_flags(triads: Sequence[MeasuredTriad]) -> tuple[Flag, ...]:
    """Return a flag for each ball whose centre a person placed."""
    return tuple(
        Flag(
            "ball-manual",
            f"triad {number} along the spine: a person placed the centre of ball {name} in the"
            f" {' and '.join(ball.manual_in)} image; its deviation is that of such a centre",
        )
        for number, triad in enumerate(triads, start=1)
        for name, ball in triad.balls.items()
        if ball.manual_in
    )


def _pose_flags(triads: Sequence[MeasuredTriad]) -> tuple[Flag, ...]:
    """Return a flag for each triad without a pose."""
    flags = []
    for number, triad in enumerate(triads, start=1):
        detail = f"triad {number} along the spine has no pose: {triad.reason}"
        if triad.doubtful:
            flags.append(Flag("triad-doubtful", detail))
        elif triad.pose is None:
            flags.append(Flag("triad-incomplete", detail))
    return tuple(flags)


def _count_flags(triads: Sequence[MeasuredTriad], expected: int | None) -> tuple[Flag, ...]:
    """Return a flag if fewer or more triads than expected have a pose."""
    found = sum(triad.pose is not None for triad in triads)
    if expected is None or found == expected:
        return ()
    if found > expected:
        detail = f"{found} triads are in view, and {expected} were expected; name every triad in view"
        return (Flag("triad-count-high", detail),)
    detail = (
        f"{found} of {expected} triads were found; the others are hidden, or their balls were not detected"
    )
    return (Flag("triad-count-low", detail),)
