"""Options of ``process`` that say what is known of a pair: range, markers, an earlier stage."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from commands.shared.files import InputError, read_text
from contract.stage import StageResult
from spinewatch.errors import ParameterError
from spinewatch.markers import FLAT_10_14_18, MODELS, TriadModel, flat_triad, marker, orthogonal_triad
from spinewatch.pipeline import Parameters
from spinewatch.triads.labels import KnownConfiguration

_KINDS: Mapping[str, Callable[..., TriadModel]] = {"flat": flat_triad, "orthogonal": orthogonal_triad}
_LEGS = 3


def measuring_parameters(range_mm: str | None, *, refine: bool) -> Parameters:
    """Return the parameters of --range and --refine."""
    parameters = Parameters()
    matching = parameters.search.matching
    if range_mm is not None:
        near, far = _numbers(range_mm, 2, "--range", "630,760")
        if not 0 < near < far:
            raise ParameterError(
                f"--range {range_mm!r} must be the nearest and the farthest range, mm: 630,760"
            )
        matching = replace(matching, epipolar=replace(matching.epipolar, range_mm=(near, far)))
    if refine:
        matching = replace(matching, refinement=replace(matching.refinement, enabled=True))
    return replace(parameters, search=replace(parameters.search, matching=matching))


def parse_markers(texts: Sequence[str]) -> tuple[TriadModel, ...]:
    """Return the markers of --marker: names, or flat:XX,YY,MX and orthogonal:XX,YY,ZZ with the lengths of the legs."""
    return tuple(_marker(text) for text in texts) or (FLAT_10_14_18,)


def read_earlier_stage(path: Path) -> KnownConfiguration:
    """Return the labelled triads of a document of ``process``, to which labels are compared (H4)."""
    try:
        document = json.loads(read_text(path))
        result = StageResult.model_validate_json(
            json.dumps({name: document[name] for name in StageResult.model_fields if name in document})
        )
    except (ValueError, TypeError) as error:
        raise InputError(
            f"{path} is not a stage; give what `spinewatch process` wrote with labels"
        ) from error
    poses = {triad.label: triad.pose() for triad in result.triads if triad.label is not None}
    if len(poses) < 2:
        raise InputError(f"{path} has fewer than two labelled triads; measure it with --labels")
    return KnownConfiguration(poses={label: pose for label, pose in poses.items() if pose is not None})


def _marker(text: str) -> TriadModel:
    kind, separator, legs = text.partition(":")
    if not separator:
        return marker(text)
    if kind not in _KINDS:
        raise ParameterError(
            f"--marker {text!r} is none of {', '.join(sorted(MODELS))}, flat:... or orthogonal:..."
        )
    lengths = _numbers(legs, _LEGS, "--marker", f"{kind}:18,14,10")
    if min(lengths) <= 0:
        raise ParameterError(f"--marker {text!r} must have positive lengths, mm")
    return _KINDS[kind](*lengths)


def _numbers(text: str, count: int, option: str, example: str) -> tuple[float, ...]:
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError as error:
        raise ParameterError(f"{option} {text!r} must be numbers, like {example}") from error
    if len(values) != count:
        raise ParameterError(f"{option} {text!r} must be {count} numbers, like {example}")
    return values
