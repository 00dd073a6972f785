"""Numbers of the API as the page writes them."""

from __future__ import annotations

from decimal import ROUND_HALF_UP, Decimal

MINUS = "\N{MINUS SIGN}"


def fixed(value: float, digits: int = 1) -> str:
    """Return a number with fixed digits and a true minus sign; never a negative zero."""
    step = Decimal(1).scaleb(-digits)
    rounded = abs(Decimal(value)).quantize(step, rounding=ROUND_HALF_UP)
    return f"{MINUS if value < 0 and rounded else ''}{rounded}"


def signed(value: float, digits: int = 1) -> str:
    """Return a change: with a plus sign where it is positive."""
    text = fixed(value, digits)
    return f"+{text}" if value > 0 and Decimal(text) else text


def interval(ends: list[float], unit: str) -> str:
    """Return an interval with its unit."""
    return f"{fixed(ends[0])} to {fixed(ends[1])}{unit}"
