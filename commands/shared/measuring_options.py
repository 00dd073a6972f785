"""Options of ``process`` that say what is known of a pair: range, markers, an earlier stage."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from commands.shared.files import InputError, read_text
from contract import measuring
from contract.stage import StageResult
from spinewatch.errors import ParameterError
from spinewatch.markers import FLAT_10_14_18, TriadModel, parse_marker
from spinewatch.triads.known_configuration import KnownConfiguration


def parse_range(text: str | None) -> tuple[float, float] | None:
    """Return the nearest and the farthest range of --range, mm."""
    try:
        return None if text is None else measuring.parse_range(text)
    except ValueError as error:
        raise ParameterError(
            f"--range {text!r} must be the nearest and the farthest range, mm: 630,760"
        ) from error


def parse_markers(texts: Sequence[str]) -> tuple[TriadModel, ...]:
    """Return the markers of --marker, by default the flat marker of the thesis."""
    return tuple(parse_marker(text) for text in texts) or (FLAT_10_14_18,)


def read_earlier_stage(path: Path) -> KnownConfiguration:
    """Return the labelled triads of a document of ``process``, to which labels are compared (H4)."""
    try:
        document = json.loads(read_text(path))
        result = StageResult.model_validate_json(
            json.dumps({name: document[name] for name in StageResult.model_fields if name in document})
        )
    except (ValueError, TypeError, RecursionError) as error:
        raise InputError(
            f"{path} is not a stage; give what `spinewatch process` wrote with labels"
        ) from error
    poses = {triad.label: triad.pose() for triad in result.triads if triad.label is not None}
    if len(poses) < 2:
        raise InputError(f"{path} has fewer than two labelled triads; measure it with --labels")
    return KnownConfiguration(poses={label: pose for label, pose in poses.items() if pose is not None})
