"""Campaigns of fuzzing: a number of inputs that follow from a seed, and more of them for as long as a time is given.

``FUZZ_SECONDS`` is the time of each campaign beyond its fixed inputs, ``FUZZ_SEED`` their seed, and ``FUZZ_KEEP=1``
adds the inputs that had an outcome of a new kind to the corpus.
"""

from __future__ import annotations

import hashlib
import os
import re
import time
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

CORPUS = Path(__file__).parent / "corpus"
INPUTS = 2000
_LARGEST_KEPT = 2_500
_NUMBER = re.compile(r"[0-9]+")

Mutate = Callable[[np.random.Generator, list[bytes]], bytes]
Check = Callable[[bytes], str]
"""Runs one input; returns the kind of its outcome, and raises if the outcome is none that may be."""


def corpus(kind: str) -> list[bytes]:
    """Return the kept inputs of a kind, in the order of their names."""
    return [path.read_bytes() for path in sorted((CORPUS / kind).iterdir())]


def run(kind: str, seeds: list[bytes], mutate: Mutate, check: Check) -> None:
    """Check the corpus, and mutations of the corpus and of seeds; an unexpected outcome fails with the input."""
    known = [*seeds, *corpus(kind)]
    kinds = {_checked(check, data) for data in known}
    for rng in _generators():
        data = mutate(rng, known)
        outcome = _checked(check, data)
        if outcome in kinds:
            continue
        kinds.add(outcome)
        known.append(data)
        if os.environ.get("FUZZ_KEEP") and len(data) <= _LARGEST_KEPT:
            (CORPUS / kind / hashlib.sha256(data).hexdigest()[:12]).write_bytes(data)


def outcome_of(error: BaseException | None) -> str:
    """Return the kind of an outcome: the classes of the error and of its causes, and its sentence without numbers."""
    words = []
    while error is not None:
        words.append(f"{type(error).__name__}: {_NUMBER.sub('0', str(error))[:80]}")
        error = error.__cause__
    return " < ".join(words) or "accepted"


def _generators() -> Iterator[np.random.Generator]:
    seed = int(os.environ.get("FUZZ_SEED", "1"))
    end = time.monotonic() + float(os.environ.get("FUZZ_SECONDS", "0"))
    number = 0
    while number < INPUTS or time.monotonic() < end:
        yield np.random.default_rng([seed, number])
        number += 1


def _checked(check: Check, data: bytes) -> str:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter(
                "ignore"
            )  # as outside tests: parsers warn of damage, which is no error of ours
            return check(data)
    except Exception as error:
        raise AssertionError(f"unexpected {type(error).__name__} for the input {data[:4000]!r}") from error
