"""Numbers of a report as text: with unit, sign, interval and standard deviation."""

from __future__ import annotations

from collections.abc import Sequence

from reports.rendering import UNKNOWN

_SYMBOLS = {"deg": "°", "mm": " mm"}
_MINUS = "\N{MINUS SIGN}"
_DECIMALS = 1


def amount(value: float | None, unit: str, *, signed: bool = False) -> str:
    """Return a value with its unit.

    Parameters
    ----------
    value
        The value; None when not measured.
    unit
        ``deg``, ``mm`` or empty.
    signed
        Whether a positive value gets a plus sign, as changes do.

    Returns
    -------
    str
        The text; a dash for None.

    Examples
    --------
    >>> amount(58.26, "deg"), amount(1.0, "mm", signed=True), amount(None, "deg")
    ('58.3°', '+1.0 mm', '–')
    """
    return (
        UNKNOWN if value is None else _digits(value, signed=signed) + _SYMBOLS.get(unit, f" {unit}".rstrip())
    )


def interval(ends: Sequence[float | None] | None, unit: str, *, signed: bool = False) -> str:
    """Return a 95% interval.

    Parameters
    ----------
    ends
        Its ends; None when unknown.
    unit
        ``deg`` or ``mm``.
    signed
        Whether positive ends get a plus sign.

    Returns
    -------
    str
        The text; empty when an end is unknown.

    Examples
    --------
    >>> interval([56.144, 60.456], "deg"), interval(None, "deg")
    ('56.1 to 60.5°', '')
    """
    if ends is None or len(ends) != 2 or ends[0] is None or ends[1] is None:
        return ""
    return f"{_digits(ends[0], signed=signed)} to {amount(ends[1], unit, signed=signed)}"


def with_sd(value: float | None, sd: float | None, *, signed: bool = True) -> str:
    """Return a value with its standard deviation, without a unit.

    Parameters
    ----------
    value
        The value; None when not measured.
    sd
        Its standard deviation; None when unknown.
    signed
        Whether a positive value gets a plus sign.

    Returns
    -------
    str
        The text; a dash for None.

    Examples
    --------
    >>> with_sd(1.5, 0.52), with_sd(2.0, None), with_sd(None, None)
    ('+1.5 ± 0.5', '+2.0 ± ?', '–')
    """
    if value is None:
        return UNKNOWN
    return f"{_digits(value, signed=signed)} ± {'?' if sd is None else _digits(sd)}"


def with_interval(value: float | None, ends: Sequence[float | None] | None) -> str:
    """Return a value with its 95% interval, without a unit and a sign.

    Parameters
    ----------
    value
        The value, never negative; None when not measured.
    ends
        Ends of the interval; None when unknown.

    Returns
    -------
    str
        The text; a dash for None.

    Examples
    --------
    >>> with_interval(1.5, [0.0, 2.92]), with_interval(1.5, None), with_interval(None, None)
    ('1.5 (0.0 to 2.9)', '1.5 (?)', '–')
    """
    return UNKNOWN if value is None else f"{_digits(value)} ({interval(ends, '') or '?'})"


def _digits(value: float, *, signed: bool = False) -> str:
    rounded = round(value, _DECIMALS) + 0.0
    text = f"{rounded:{'+' if signed and rounded else ''}.{_DECIMALS}f}"
    return text.replace("-", _MINUS)
