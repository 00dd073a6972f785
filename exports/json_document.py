"""JSON: the summary of a surgery with its definitions, under a named and versioned schema."""

from __future__ import annotations

import json
from typing import Any

from contract.summary import SurgerySummary
from exports.definitions import definition_table, definitions_of
from exports.selection import selected_spines, selected_stages

MEDIA_TYPE = "application/json"
FILE_SUFFIX = ".json"
SCHEMA = "spinewatch/surgery-summary"
SCHEMA_VERSION = 1

_CONVENTIONS = {
    "axes": "patient axes of the frame that each spine names: x anterior, y left, z cephalad; right-handed",
    "units": "mm and degrees, as the names of fields say",
    "intervals": "95%",
    "null": "not measured or not known; the field reason says why",
}


def export(summary: SurgerySummary, stage: str | None = None) -> bytes:
    """Return the summary of a surgery as a JSON document.

    Parameters
    ----------
    summary
        The surgery with all its stages.
    stage
        Name of one stage; None for all.

    Returns
    -------
    bytes
        JSON, UTF-8. ``summary`` is the contract model `SurgerySummary`, ``definitions`` says what its measures are.

    Raises
    ------
    UnknownStageError
        If the surgery has no stage of that name.
    """
    held = summary.model_copy(update={"stages": selected_stages(summary, stage)})
    document: dict[str, Any] = {
        "schema": SCHEMA,
        "schema_version": SCHEMA_VERSION,
        "generator": "Spinewatch",
        "conventions": _CONVENTIONS,
        "definitions": definition_table(definitions_of(selected_spines(summary, stage))),
        "summary": held.model_dump(mode="json"),
    }
    return (json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode()
