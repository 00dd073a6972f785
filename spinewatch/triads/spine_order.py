"""The order of triads along the spine, and whether the object axis that was given determines it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from spinewatch.arrays import Float
from spinewatch.matching.selection_parameters import SpineAxis
from spinewatch.triads.pose import MeasuredTriad


def in_order(triads: Sequence[MeasuredTriad], axis: SpineAxis) -> list[MeasuredTriad]:
    """Return triads in order along the spine axis.

    Parameters
    ----------
    triads
        Measured triads.
    axis
        Object axis along which the spine extends; "auto" is that of greatest extent.

    Returns
    -------
    list of MeasuredTriad
        The triads by increasing coordinate of their position.
    """
    if not triads:
        return []
    P = np.stack([t.position_mm for t in triads])
    return [triads[i] for i in np.argsort(P[:, axis_number(P, axis)], kind="stable")]


def axis_number(positions_mm: Float, axis: SpineAxis) -> int:
    """Return the object axis along which triads are ordered.

    Parameters
    ----------
    positions_mm
        Positions of the triads, shape (n, 3), mm.
    axis
        Object axis along which the spine extends; "auto" is that of greatest extent.

    Returns
    -------
    int
        0 for x, 1 for y.
    """
    return int(np.argmax(np.ptp(positions_mm[:, :2], axis=0))) if axis == "auto" else "xy".index(axis)


def axis_problem(
    positions_mm: Float, axis: SpineAxis, max_angle_deg: float, min_margin_deg: float
) -> str | None:
    """Return why the order of triads along the axis is not their order along the spine.

    Parameters
    ----------
    positions_mm
        Positions of the triads, shape (n, 3), mm.
    axis
        Object axis along which the spine extends; "auto" is that of greatest extent.
    max_angle_deg
        Largest angle between a given axis and the line along which the triads lie, degrees.
    min_margin_deg
        Least angle of that line from 45 degrees to the axes for which the order along the axis "auto" is determined,
        degrees, if it differs between the axes.

    Returns
    -------
    str or None
        Sentence with the angle; None if the order along the axis is that along the spine.

    Examples
    --------
    >>> steep = np.array([[0.0, 0.0, 0.0], [10.0, 50.0, 0.0]])
    >>> axis_problem(steep, "y", 60, 5) is None, axis_problem(steep, "x", 60, 5)[:45]
    (True, 'the triads lie along a line at 79 degrees to ')
    """
    if len(positions_mm) < 2:
        return None
    P = positions_mm[:, :2]
    line = np.linalg.svd(P - P.mean(axis=0))[2][0]
    to_x = float(np.degrees(np.arctan2(abs(line[1]), abs(line[0]))))
    if axis != "auto":
        angle = to_x if axis == "x" else 90 - to_x
        if angle <= max_angle_deg:
            return None
        return (
            f"the triads lie along a line at {angle:.0f} degrees to the spine axis {axis}, more than"
            f" {max_angle_deg:g}; give the axis along which the spine lies"
        )
    orders = [list(np.argsort(P[:, k], kind="stable")) for k in (0, 1)]
    if abs(to_x - 45) >= min_margin_deg or orders[0] == orders[1]:
        return None
    return (
        f"the triads lie along a line at {to_x:.0f} degrees to the x axis, and their order along x is not that along y;"
        " give the spine axis, x or y"
    )
