"""Revisions of stages: the parameters and templates of a new measurement."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from pydantic import TypeAdapter, ValidationError
from pydantic_core import to_jsonable_python

from contract.stage import StageResult
from spinewatch.detection.candidates.templates import TemplateSet, default_template_set
from spinewatch.errors import ParameterError, SpinewatchError
from spinewatch.parameters import Parameters

Changed = Mapping[str, tuple[Any, Any]]
"""Values of parameters and the usual ones, by name."""

_PARAMETERS = TypeAdapter(Parameters)


class UnknownTemplatesError(SpinewatchError):
    """The worker has no template set of the version that was asked for."""

    code = "unknown-templates"


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
    spinewatch.parameters.Parameters
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


def with_changes(parameters: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return nested parameters of which some are replaced or added.

    Parameters
    ----------
    parameters, changes
        Nested parameters, each with some of those of a method.

    Returns
    -------
    dict
        All of them; those of ``changes`` where both have one.
    """
    found = dict(parameters)
    for name, value in changes.items():
        before = found.get(name)
        if isinstance(before, Mapping) and isinstance(value, Mapping):
            found[name] = with_changes(before, value)
        else:
            found[name] = value
    return found


def changed_parameters(
    used: Mapping[str, Any], usual: Mapping[str, Any], place: str = ""
) -> dict[str, tuple[Any, Any]]:
    """Return the parameters whose value is not the usual one.

    Parameters
    ----------
    used, usual
        All parameters of the method, nested alike.
    place
        Path of the parameters, which begins the names.

    Returns
    -------
    dict of str to tuple
        The value used and the usual one, by the path of the parameter.

    Examples
    --------
    >>> changed_parameters({"a": {"b": 1, "c": 2}}, {"a": {"b": 1, "c": 3}})
    {'a.c': (2, 3)}
    """
    found: dict[str, tuple[Any, Any]] = {}
    for name, value in used.items():
        path = f"{place}.{name}".lstrip(".")
        if isinstance(value, Mapping):
            found |= changed_parameters(value, usual[name], path)
        elif value != usual[name]:
            found[path] = value, usual[name]
    return found


def changes_text(changed: Changed) -> str:
    """Return changed parameters in words.

    Parameters
    ----------
    changed
        Value used and usual value by name, as of `changed_parameters`.

    Returns
    -------
    str
        The names, and the values but for lists.

    Examples
    --------
    >>> changes_text({"a.c": (2, 3), "b": ([1, 2], [1, 3])})
    'a.c (2 instead of 3), b'
    """
    return ", ".join(
        name if isinstance(value, list) else f"{name} ({json.dumps(value)} instead of {json.dumps(usual)})"
        for name, (value, usual) in changed.items()
    )


def parameters_of(result: StageResult) -> dict[str, Any]:
    """Return the parameters that a result was measured with, without the settings beside them.

    Parameters
    ----------
    result
        The result.

    Returns
    -------
    dict
        Parameters of the method, nested.
    """
    own = {field.name for field in fields(Parameters)}
    return {name: value for name, value in result.parameters.items() if name in own}


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
