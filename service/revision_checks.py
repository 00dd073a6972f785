"""Whether what a revision asks for fits the take that it revises."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from contract.features import FeaturePair
from contract.parameter_ranges import require_plausible
from contract.revision import AddedCentre, CentreEdit, Remeasurement, RemovedCentre, TriadEdits
from contract.triad import Triad
from service.problems import InvalidInputError
from spinewatch.errors import ParameterError, SpinewatchError
from store.errors import FeaturesMissingError


class UnknownTriadError(SpinewatchError):
    """The take has no triad of this number."""

    code = "unknown-triad"


class LabelError(SpinewatchError):
    """A label is none of the surgery's, or two triads would have it."""

    code = "invalid-label"


class CentreOutsideError(SpinewatchError):
    """A ball centre is not inside its image."""

    code = "centre-outside-image"


class UnknownFeatureError(SpinewatchError):
    """The pair has no feature of this number."""

    code = "unknown-feature"


class UnknownPairError(SpinewatchError):
    """The stage has no pair of this number."""

    code = "unknown-pair"


class UnknownParameterError(SpinewatchError):
    """The method has no parameter of this name."""

    code = "invalid-parameter"


@dataclass(frozen=True)
class EditedPair:
    """A pair whose ball centres are edited: its features, None when they were not kept, and the sizes of its images."""

    features: FeaturePair | None
    sizes: Mapping[str, tuple[int, int]]


def check_edits(edits: TriadEdits, triads: Sequence[Triad], vertebrae: Sequence[str]) -> None:
    """Raise ``InvalidInputError`` unless the edits fit the triads of the take and the vertebrae of the surgery."""
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


def check_centres(centres: Sequence[CentreEdit], pairs: Mapping[int, EditedPair | None]) -> None:
    """Raise ``InvalidInputError`` unless the edits of ball centres fit the features and images of their pairs."""
    for index, edit in enumerate(centres):
        pair = pairs[edit.pair]
        problem = _centre_problem(edit, pair)
        if problem is not None:
            raise InvalidInputError("centres", problem, index)


def _centre_problem(edit: CentreEdit, pair: EditedPair | None) -> SpinewatchError | None:
    if pair is None:
        return UnknownPairError("the stage has no pair of this number; see pairs of the stage")
    if pair.features is None:
        return FeaturesMissingError(edit.pair)
    if not isinstance(edit, AddedCentre):
        count = len(getattr(pair.features, edit.side))
        if edit.feature >= count:
            return UnknownFeatureError(
                f"the {edit.side} image has {count} features, numbered from 0; see the features of the pair"
            )
    if not isinstance(edit, RemovedCentre):
        width, height = pair.sizes[edit.side]
        if not (-0.5 <= edit.x <= width - 0.5 and -0.5 <= edit.y <= height - 0.5):
            return CentreOutsideError(
                f"the {edit.side} image has {width} x {height} pixels, and its first pixel has its centre at 0, 0; give"
                " a centre inside it"
            )
    return None


def check_parameters(wanted: Remeasurement, known: Mapping[str, Any], own: Mapping[str, Any]) -> None:
    """Raise ``InvalidInputError`` for a parameter that does not exist, or a value that cannot be right.

    ``known`` are the parameters of the take's result, ``own`` those of the workers without any change.
    """
    _require_known(wanted, known)
    try:
        require_plausible(wanted.parameters, own)
    except ParameterError as error:
        raise InvalidInputError("parameters", error) from error


def _require_known(wanted: Remeasurement, known: Mapping[str, Any]) -> None:
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
