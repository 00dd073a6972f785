"""Revisions of stages: edits of a result by a person, and the parameters and templates of a new measurement."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import TypeAdapter, ValidationError
from pydantic_core import to_jsonable_python

from contract.revision import TriadEdits
from contract.stage import StageResult
from contract.triad import Triad
from spinewatch.detection.candidates.templates import TemplateSet, default_template_set
from spinewatch.errors import ParameterError, SpinewatchError
from spinewatch.pipeline import LABELS_UNCERTAIN, Parameters

_TAKEN_AWAY = "the label was taken away by a person"
_PARAMETERS = TypeAdapter(Parameters)


class UnknownTemplatesError(SpinewatchError):
    """The worker has no template set of the version that was asked for."""

    code = "unknown-templates"


def edited(result: StageResult, edits: TriadEdits, vertebrae: Sequence[str]) -> StageResult:
    """Return a result with the edits of its triads; everything else stays as it was measured.

    Parameters
    ----------
    result
        The result.
    edits
        Labels that are confirmed, changed or taken away, and triads that are left out.
    vertebrae
        Labels in their order.

    Returns
    -------
    StageResult
        Triads in the order of their labels, those without one last. The flag of uncertain labels stays while a triad
        has none.
    """
    labels = {edit.triad: edit.label for edit in edits.labels}
    kept = [
        _labelled(triad, labels[index]) if index in labels else triad
        for index, triad in enumerate(result.triads)
        if index not in edits.removed
    ]
    place = {label: number for number, label in enumerate(vertebrae)}
    triads = sorted(kept, key=lambda triad: place.get(triad.label or "", len(place)))
    certain = all(triad.label is not None for triad in triads)
    flags = [flag for flag in result.flags if not (certain and flag.code == LABELS_UNCERTAIN)]
    return result.model_copy(update={"triads": triads, "flags": flags})


def revised_parameters(parameters: Parameters, changes: Mapping[str, Any]) -> Parameters:
    """Return parameters with some of them replaced.

    Parameters
    ----------
    parameters
        All parameters.
    changes
        Those that differ, nested as in the parameters of a result.

    Returns
    -------
    pipeline.Parameters
        All parameters.

    Raises
    ------
    ParameterError
        A name is unknown, or a value cannot be used.
    """
    merged = _merged(to_jsonable_python(parameters), changes, "")
    try:
        return _PARAMETERS.validate_json(json.dumps(merged))
    except ValidationError as error:
        first = error.errors(include_input=False, include_url=False)[0]
        place = ".".join(map(str, first["loc"]))
        raise ParameterError(
            f"the parameter {place} cannot be used: {first['msg']}; see those of the result"
        ) from error


def chosen_templates(version: str | None, own: TemplateSet) -> TemplateSet:
    """Return the template set of a version.

    Parameters
    ----------
    version
        Its version; None for the worker's own.
    own
        The worker's own set.

    Returns
    -------
    TemplateSet
        The worker's own set, or the one that ships with the library.

    Raises
    ------
    UnknownTemplatesError
        Neither is of this version.
    """
    if version in {None, own.version}:
        return own
    shipped = default_template_set()
    if version == shipped.version:
        return shipped
    raise UnknownTemplatesError(
        f"this worker has the template sets {own.version} and {shipped.version}; ask for one of them, or set"
        " SPINEWATCH_TEMPLATES"
    )


def _labelled(triad: Triad, label: str | None) -> Triad:
    return triad.model_copy(update={"label": label, "label_reason": _TAKEN_AWAY if label is None else None})


def _merged(values: Mapping[str, Any], changes: Mapping[str, Any], place: str) -> dict[str, Any]:
    merged = dict(values)
    for name, change in changes.items():
        if name not in values or isinstance(values[name], dict) != isinstance(change, dict):
            raise ParameterError(
                f"there is no such parameter in {place or 'the method'}; see those of the result"
            )
        nested = isinstance(change, dict)
        merged[name] = _merged(values[name], change, f"{place}.{name}".lstrip(".")) if nested else change
    return merged
