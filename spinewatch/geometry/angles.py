"""Angles packed as DDDMMSS.s, the notation of Table 3.3."""

from __future__ import annotations

import numpy as np

from spinewatch.errors import ParameterError


def degrees_from_dms(packed: float) -> float:
    """Return the decimal degrees of an angle packed as DDDMMSS.s.

    Parameters
    ----------
    packed
        The angle, for example -160512.3 for -16 degrees 5 minutes 12.3 seconds.

    Returns
    -------
    float
        The angle, degrees.

    Raises
    ------
    ParameterError
        If minutes or seconds are not below 60.

    Examples
    --------
    >>> degrees_from_dms(-163000.0)
    -16.5
    """
    degrees, rest = divmod(abs(packed), 10_000)
    minutes, seconds = divmod(rest, 100)
    if minutes >= 60 or seconds >= 60:
        raise ParameterError(f"{packed} is not an angle in DDDMMSS.s: minutes and seconds must be below 60")
    return float(np.copysign(degrees + minutes / 60 + seconds / 3600, packed))


def dms_from_degrees(degrees: float) -> str:
    """Return the text of an angle packed as DDDMMSS.s, with seven decimals of a second.

    Parameters
    ----------
    degrees
        The angle, degrees.

    Returns
    -------
    str
        The packed angle, rounded to 1e-7 seconds of arc, some 3e-11 degrees.

    Examples
    --------
    >>> dms_from_degrees(-16.5)
    '-163000.0000000'
    """
    units = round(abs(degrees) * 3600 * 10**7)
    seconds, fraction = divmod(units, 10**7)
    whole, rest = divmod(seconds, 3600)
    minutes, seconds = divmod(rest, 60)
    sign = "-" if degrees < 0 and units else ""
    return f"{sign}{whole}{minutes:02d}{seconds:02d}.{fraction:07d}"
