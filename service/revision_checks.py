"""Whether what a revision asks for fits the take that it revises."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from contract.revision import Remeasurement, TriadEdits
from contract.triad import Triad
from service.problems import InvalidInputError
from spinewatch.errors import SpinewatchError


class UnknownTriadError(SpinewatchError):
    """The take has no triad of this number."""

    code = "unknown-triad"


class LabelError(SpinewatchError):
    """A label is none of the surgery's, or two triads would have it."""

    code = "invalid-label"


class BurstNotEditableError(SpinewatchError):
    """The triads of a burst are means over its pairs, in which an edit has no counterpart."""

    code = "burst-not-editable"


class UnknownParameterError(SpinewatchError):
    """The method has no parameter of this name."""

    code = "invalid-parameter"


def check_edits(
    edits: TriadEdits, triads: Sequence[Triad], vertebrae: Sequence[str], *, is_burst: bool
) -> None:
    """Raise ``InvalidInputError`` unless the edits fit the triads of the take and the vertebrae of the surgery."""
    if is_burst:
        raise InvalidInputError(
            "kind",
            BurstNotEditableError(
                "the triads of a burst are means over its pairs; measure it again, or take it again"
            ),
        )
    named = [("labels", k, edit.triad) for k, edit in enumerate(edits.labels)]
    named += [("removed", k, triad) for k, triad in enumerate(edits.removed)]
    for field, index, triad in named:
        if triad >= len(triads):
            error: SpinewatchError = UnknownTriadError(
                f"the take has {len(triads)} triads, numbered from 0; see its triads"
            )
            raise InvalidInputError(field, error, index)
    for index, edit in enumerate(edits.labels):
        if edit.label is not None and edit.label not in vertebrae:
            error = LabelError(f"no marker is on this vertebra; give one of {', '.join(vertebrae)}")
            raise InvalidInputError("labels", error, index)
    labels = {index: triad.label for index, triad in enumerate(triads) if index not in edits.removed}
    labels |= {edit.triad: edit.label for edit in edits.labels}
    twice = [label for label, count in Counter(labels.values()).items() if label is not None and count > 1]
    if twice:
        error = LabelError(
            f"two triads would be labelled {twice[0]}; change or take away the other label too"
        )
        raise InvalidInputError("labels", error)


def check_parameters(wanted: Remeasurement, known: Mapping[str, Any]) -> None:
    """Raise ``InvalidInputError`` for a parameter that the result of the take does not have."""
    waiting: list[tuple[Mapping[str, Any], Mapping[str, Any]]] = [(wanted.parameters, known)]
    while waiting:
        given, there = waiting.pop()
        for name, value in given.items():
            nested = isinstance(there.get(name), dict)
            if name not in there or nested != isinstance(value, dict):
                error = UnknownParameterError(
                    "a parameter of this name or form does not exist; see parameters of the take's triads"
                )
                raise InvalidInputError("parameters", error)
            if nested:
                waiting.append((value, there[name]))
