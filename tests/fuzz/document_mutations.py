"""Mutations of JSON documents: other values, other types, missing and unknown members, deep nesting, broken text."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

_MOST_CHANGES = 4
_VALUES: tuple[Any, ...] = (
    None,
    True,
    0,
    -1,
    1.5,
    1e308,
    -1e-320,
    float("nan"),
    float("inf"),
    2**63,
    10**40,
    "",
    "a\u202eb\x00\ud800",
    "L1",
    "1",
    "x" * 5000,
    [],
    {},
    [[]],
    [0] * 300,
    {"": 0},
)
_FRAGMENTS = (b"\xef\xbb\xbf", b"\xff", b"{", b"]", b",", b"1e999", b"-", b"\x00", b'"\\u0000"', b"[" * 3000)


def mutate(rng: np.random.Generator, known: list[bytes]) -> bytes:
    """Return one of the known documents with some changes, of the text where that is no JSON document."""
    data = known[rng.integers(len(known))]
    try:
        document = json.loads(data)
    except (ValueError, RecursionError):
        return _changed_text(rng, data)
    for _ in range(rng.integers(1, _MOST_CHANGES + 1)):
        document = _changed(rng, document)
    text = json.dumps(document).encode()
    return _changed_text(rng, text) if rng.random() < 0.2 else text


def _changed(rng: np.random.Generator, value: Any) -> Any:
    """Return a value with one change, at a place that is chosen on the way down."""
    if not isinstance(value, dict | list) or not value or rng.random() < 0.1:
        return _replaced(rng, value)
    copy = dict(value) if isinstance(value, dict) else list(value)
    keys = list(copy) if isinstance(copy, dict) else range(len(copy))
    key = keys[rng.integers(len(keys))]
    kind = rng.random()
    if kind < 0.1:
        del copy[key]
    elif kind < 0.2 and isinstance(copy, dict):
        copy[f"{key}{rng.choice(['', '_', ' ', chr(0)])}x"] = copy[key]
    elif kind < 0.2 and isinstance(copy, list):
        copy.extend(copy[: int(rng.integers(1, 50))])
    else:
        copy[key] = _changed(rng, copy[key])
    return copy


def _replaced(rng: np.random.Generator, value: Any) -> Any:
    if isinstance(value, float) and rng.random() < 0.5:
        return value * float(rng.choice([-1.0, 0.0, 1e-6, 1e3, 1e12]))
    if isinstance(value, str) and rng.random() < 0.3:
        return value[: int(rng.integers(len(value) + 1))] + str(
            rng.choice(["", " ", "\n", "é", "=1+1", "<b>"])
        )
    if rng.random() < 0.1:
        for _ in range(rng.integers(1, 200)):
            value = [value]
        return value
    return _VALUES[rng.integers(len(_VALUES))]


def _changed_text(rng: np.random.Generator, data: bytes) -> bytes:
    at = int(rng.integers(len(data) + 1))
    if rng.random() < 0.3:
        return data[:at]
    return data[:at] + _FRAGMENTS[rng.integers(len(_FRAGMENTS))] + data[at + int(rng.integers(3)) :]
