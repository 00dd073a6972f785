"""Whether a JSON body may be decoded: values and levels are bounded, no field is given twice, numbers are finite."""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from typing import Any

from service.limits import MAX_ERRORS, MAX_JSON_DEPTH, MAX_JSON_DIGITS, MAX_JSON_VALUES
from spinewatch.errors import SpinewatchError

Location = tuple[str | int, ...]

_STRING = re.compile(rb'"(?:[^"\\]|\\.)*+"', re.DOTALL)
_UNSTORABLE = re.compile("[\0\ud800-\udfff]")


class JSONError(SpinewatchError):
    """A JSON body that is refused before it is compared with a schema; ``problems`` has place, sentence and kind."""

    code = "invalid-request"

    def __init__(self, *problems: tuple[Location, str, str]) -> None:
        super().__init__("the body is not a JSON document that can be taken; see errors")
        self.problems = problems


class _Object(list[tuple[str, Any]]):
    """The members of an object in order, also those of the same name."""


class _Refused:
    """A number that is not taken, and why."""

    def __init__(self, reason: str) -> None:
        self.reason = reason


def check_json(body: bytes) -> None:
    """Raise ``JSONError`` unless the body is JSON within the limits; its cost is bounded by the size of the body."""
    if _separators(body) > MAX_JSON_VALUES and _separators(_STRING.sub(b"", body)) > MAX_JSON_VALUES:
        raise JSONError(
            ((), f"more than {MAX_JSON_VALUES} values; send a smaller document", "too_many_values")
        )
    try:
        document = json.loads(
            body.decode("utf-8-sig"),
            object_pairs_hook=_Object,
            parse_constant=lambda name: _Refused(f"{name} is not a number in JSON"),
            parse_float=_number,
            parse_int=_number,
        )
    except UnicodeDecodeError as error:
        raise JSONError(((error.start,), "not UTF-8; send JSON in UTF-8", "json_invalid")) from error
    except json.JSONDecodeError as error:
        raise JSONError(((error.pos,), f"not JSON: {error.msg}", "json_invalid")) from error
    except RecursionError as error:
        raise _too_deep(()) from error
    problems = _problems(document)
    if problems:
        raise JSONError(*problems)


def _separators(text: bytes) -> int:
    """Return the number of values, or more when texts contain commas or brackets."""
    return text.count(b",") + text.count(b"[") + text.count(b"{")


def _number(text: str) -> Any:
    if len(text) > MAX_JSON_DIGITS:
        return _Refused(f"a number of more than {MAX_JSON_DIGITS} characters; write it shorter")
    number = float(text)
    return number if math.isfinite(number) else _Refused("the number is too large")


def _problems(document: Any) -> list[tuple[Location, str, str]]:
    """Return what is wrong in a decoded document, at most ``MAX_ERRORS`` entries."""
    found: list[tuple[Location, str, str]] = []
    waiting: list[tuple[Location, Any]] = [((), document)]
    while waiting and len(found) < MAX_ERRORS:
        place, value = waiting.pop()
        if isinstance(value, _Refused):
            found.append((place, value.reason, "number_refused"))
        elif isinstance(value, str) and _UNSTORABLE.search(value):
            found.append((place, "a text with a NUL or half a surrogate pair; remove it", "text_refused"))
        elif isinstance(value, list):
            if len(place) >= MAX_JSON_DEPTH:
                raise _too_deep(place)
            if isinstance(value, _Object):
                found += _repeated(place, value)
                children: list[tuple[Location, Any]] = [((*place, key), inner) for key, inner in value]
            else:
                children = [((*place, index), inner) for index, inner in enumerate(value)]
            waiting += reversed(children)
    return found[:MAX_ERRORS]


def _repeated(place: Location, members: _Object) -> list[tuple[Location, str, str]]:
    if len({key for key, _ in members}) == len(members):
        return []
    count = Counter(key for key, _ in members)
    repeated = [key for key, times in count.items() if times > 1][:MAX_ERRORS]
    return [((*place, key), "the field is given twice; keep one", "field_repeated") for key in repeated]


def _too_deep(place: Location) -> JSONError:
    return JSONError((place, f"more than {MAX_JSON_DEPTH} levels; send a flatter document", "too_deep"))
