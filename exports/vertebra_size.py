"""Nominal sizes of vertebral bodies, for drawing only: nothing is measured from them."""

from __future__ import annotations

import numpy as np

_FIRST = {"C": 0.0, "T": 7.0, "L": 19.0, "S": 24.0}
_KNOTS = (0.0, 7.0, 12.0, 18.0, 21.0, 24.0, 29.0)
_WIDTH_MM = (18.0, 28.0, 26.0, 38.0, 45.0, 50.0, 20.0)
_DEPTH_MM = (15.0, 18.0, 25.0, 31.0, 34.0, 34.0, 12.0)
_HEIGHT_MM = (13.0, 16.0, 19.0, 24.0, 27.0, 28.0, 15.0)


def body_size_mm(vertebra: str) -> tuple[float, float, float]:
    """Return the nominal size of a vertebral body.

    Parameters
    ----------
    vertebra
        Its name, such as ``T9``.

    Returns
    -------
    tuple of float
        Depth (along its x axis), width (along y) and height (along z), mm.

    Examples
    --------
    >>> body_size_mm("L3")
    (34.0, 45.0, 27.0)
    """
    place = min(_FIRST[vertebra[0]] + int(vertebra[1:]) - 1.0, _KNOTS[-1])
    depth, width, height = (
        float(np.interp(place, _KNOTS, values)) for values in (_DEPTH_MM, _WIDTH_MM, _HEIGHT_MM)
    )
    return depth, width, height
