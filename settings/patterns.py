"""Regular expressions that a site sets: how many ways a text can be tried in, before the service matches one."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from re import _constants as code  # type: ignore[attr-defined]
from re import _parser as parser  # type: ignore[attr-defined]
from typing import Any

MAX_TEXT = 64
"""Characters of the longest text that is matched: those of a case number."""

_MAX_WAYS = 1_000_000
_ADVICE = (
    "a text of 64 characters could keep this pattern busy for minutes; make its repetitions possessive (++, *+),"
    " or give them upper limits such as {1,8}"
)

Ways = tuple[int, ...]
"""Number of ways in which a part of a pattern takes 0, 1, ... characters of any text, an upper bound."""

_NOTHING: Ways = (1,)


def require_bounded(pattern: str) -> None:
    """Raise ``ValueError`` if a text of ``MAX_TEXT`` characters may be tried in too many ways.

    The characters themselves are not looked at, so the number is an upper bound.

    Parameters
    ----------
    pattern
        A valid regular expression.

    Raises
    ------
    ValueError
        With advice on how to write it.

    Examples
    --------
    >>> require_bounded("K[0-9]+(?:-[0-9]++)*")
    >>> require_bounded("(a+)+$")
    Traceback (most recent call last):
    ValueError: a text of 64 characters could keep this pattern busy for minutes; make its repetitions possessive (++, *+), or give them upper limits such as {1,8}
    """  # noqa: E501 - the message is one line
    _sequence(parser.parse(pattern))


def _sequence(items: Iterable[tuple[Any, Any]]) -> Ways:
    ways = _NOTHING
    for kind, argument in items:
        ways = _then(ways, _part(kind, argument))
    return ways


def _part(kind: Any, argument: Any) -> Ways:
    """Return the ways of one part of a pattern."""
    count = _COUNTS.get(kind)
    return (0, 1) if count is None else count(argument)  # any other part takes one character


def _subpattern(argument: Any) -> Ways:
    return _sequence(argument[-1])


def _branch(argument: Any) -> Ways:
    return _sum(_sequence(branch) for branch in argument[1])


def _condition(argument: Any) -> Ways:
    _, yes, no = argument
    return _sum(_sequence(branch) for branch in (yes, no or ()))


def _reference(_argument: Any) -> Ways:
    return (1,)  # the same text again; an empty one leaves most of the text to what follows


def _repeat(argument: Any) -> Ways:
    fewest, most, items = argument
    once = _sequence(items)
    ways = _NOTHING
    powers = [ways]
    for _ in range(min(int(most), MAX_TEXT)):
        ways = _then(ways, once)
        powers.append(ways)
    return _checked(_sum(powers[min(fewest, len(powers) - 1) :]))


def _possessive(argument: Any) -> Ways:
    fewest, _, items = argument
    return _one_way(_sequence(items), fewest)


def _atomic(argument: Any) -> Ways:
    return _one_way(_sequence(argument), 1)


def _assertion(argument: Any) -> Ways:
    return (sum(_sequence(argument[1])),)  # takes no characters, but is tried each time


def _position(_argument: Any) -> Ways:
    return _NOTHING


_COUNTS: dict[Any, Callable[[Any], Ways]] = {
    code.SUBPATTERN: _subpattern,
    code.BRANCH: _branch,
    code.MAX_REPEAT: _repeat,
    code.MIN_REPEAT: _repeat,
    code.POSSESSIVE_REPEAT: _possessive,
    code.ATOMIC_GROUP: _atomic,
    code.ASSERT: _assertion,
    code.ASSERT_NOT: _assertion,
    code.AT: _position,
    code.GROUPREF: _reference,
    code.GROUPREF_EXISTS: _condition,
}


def _one_way(ways: Ways, times: int) -> Ways:
    """Return the ways of a part that is never tried again: one, with the fewest characters."""
    shortest = next((length for length, number in enumerate(ways) if number), MAX_TEXT)
    return (*(0,) * min(shortest * times, MAX_TEXT), 1)


def _then(first: Ways, second: Ways) -> Ways:
    """Return the ways of two parts that follow each other."""
    length = min(len(first) + len(second) - 1, MAX_TEXT + 1)
    found = [0] * length
    for taken, number in enumerate(first):
        if number:
            for more, other in enumerate(second[: length - taken]):
                found[taken + more] += number * other
    return _checked(tuple(found))


def _sum(parts: Iterable[Ways]) -> Ways:
    found: list[int] = []
    for ways in parts:
        found += [0] * (len(ways) - len(found))
        for length, number in enumerate(ways):
            found[length] += number
    return _checked(tuple(found))


def _checked(ways: Ways) -> Ways:
    if sum(ways) > _MAX_WAYS:
        raise ValueError(_ADVICE)
    return ways
