"""Values that a parameter of the method may have: one rule for all, derived from the default of each."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

from spinewatch.errors import ParameterError

MAX_FACTOR = 1000
"""Largest ratio of a number to its default, and of the default to the number."""
MAX_COUNT_FACTOR = 100
"""Largest ratio of a whole number to its default."""
MAX_ITEMS = 50
"""Largest number of items of a list."""

_FRACTION = re.compile(
    r"(^|_)(agreement|alpha|chance|chance_false|correlation|fraction|p_value|probability|rate|score|share"
    r"|significance)$"
)
"""Names of numbers that are at most 1."""


def require_plausible(changes: Mapping[str, Any], defaults: Mapping[str, Any], place: str = "") -> None:
    """Raise unless every value may be that of its parameter; parameters without a default are not checked.

    Parameters
    ----------
    changes
        Some parameters of the method, nested.
    defaults
        Parameters as they are without changes, nested alike.
    place
        Path of the parameters, for the error.

    Raises
    ------
    ParameterError
        A value cannot be right; the error names the parameter, and what it may be.

    Examples
    --------
    >>> require_plausible({"min_score": 0.1, "n_strips": 12}, {"min_score": 0.2, "n_strips": 6})
    >>> require_plausible({"n_strips": 0}, {"n_strips": 6})
    Traceback (most recent call last):
    spinewatch.errors.ParameterError: the parameter n_strips must be a whole number from 1 to 600; it is 6 by default
    """
    for name, value in changes.items():
        if name not in defaults:
            continue
        default, path = defaults[name], f"{place}.{name}".lstrip(".")
        if isinstance(default, dict) and isinstance(value, dict):
            require_plausible(value, default, path)
        elif not _fits(name, value, default):
            raise ParameterError(
                f"the parameter {path} must be {_expected(name, default)}; it is {json.dumps(default)} by default"
            )


def _fits(name: str, value: Any, default: Any) -> bool:
    """Return whether a value has the form of the default, and numbers in range; null is left to the worker."""
    if value is None or default is None:
        return True
    if isinstance(default, bool) or isinstance(value, bool):
        return type(default) is type(value)
    if isinstance(default, int | float):
        return isinstance(value, int | float) and _is_in_range(name, value, default)
    if isinstance(default, list):
        return (
            isinstance(value, list)
            and 1 <= len(value) <= MAX_ITEMS
            and all(any(_fits(name, item, one) for one in default) for item in value)
        )
    if isinstance(default, dict):
        return (
            isinstance(value, dict)
            and value.keys() == default.keys()
            and all(_fits(key, value[key], default[key]) for key in value)
        )
    return isinstance(value, type(default))


def _is_in_range(name: str, value: float, default: float) -> bool:
    low, high = _range(name, default)
    return low <= value <= high and (not isinstance(default, int) or value % 1 == 0)


def _range(name: str, default: float) -> tuple[float, float]:
    if default == 0:
        return -MAX_FACTOR, MAX_FACTOR
    if isinstance(default, int):
        ends: tuple[float, float] = (1 if name.startswith("n_") else 0), MAX_COUNT_FACTOR * default
    elif 0 < default <= 1 and _FRACTION.search(name):
        ends = default / MAX_FACTOR, 1
    else:
        ends = default / MAX_FACTOR, default * MAX_FACTOR
    return min(ends), max(ends)


def _expected(name: str, default: Any) -> str:
    if isinstance(default, bool):
        return "true or false"
    if isinstance(default, int | float):
        return _number_expected(name, [default])
    if not isinstance(default, list):
        return "like the default"
    numbers = [item for item in default if isinstance(item, int | float)]
    each = _number_expected(name, numbers) if numbers else "like one of the default"
    return f"a list of 1 to {MAX_ITEMS} items, each {each}"


def _number_expected(name: str, defaults: Sequence[float]) -> str:
    lows, highs = zip(*(_range(name, default) for default in defaults), strict=True)
    whole = "whole " if isinstance(defaults[0], int) else ""
    return f"a {whole}number from {min(lows):g} to {max(highs):g}"
