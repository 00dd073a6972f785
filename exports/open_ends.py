"""Ends of curves at the end of the measured span, beyond which the curve may go on: what every export says of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from contract.spine import StageSpine


def open_ends(spine: StageSpine) -> Mapping[str, tuple[str, ...]]:
    """Return the open ends of the curves of a spine.

    Parameters
    ----------
    spine
        The spine at a stage.

    Returns
    -------
    dict of str to tuple of str
        End vertebrae by name of the curve; curves without an open end are not among them.
    """
    return {curve.name: tuple(curve.open_ends) for curve in spine.curves if curve.open_ends}


def beyond(levels: Sequence[str]) -> str:
    """Return the words that say what open ends mean for the measures of their curve.

    Parameters
    ----------
    levels
        The open ends, one or two.

    Returns
    -------
    str
        A clause without a full stop.

    Examples
    --------
    >>> beyond(["L1"])
    'the curve may go on beyond L1, which is the end of the measured span'
    """
    which = "which is the end" if len(levels) == 1 else "which are the ends"
    return f"the curve may go on beyond {' and '.join(levels)}, {which} of the measured span"
