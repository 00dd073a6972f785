from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from contract.revision import NewRevision, Remeasurement, TriadEdits

ADAPTER: TypeAdapter[TriadEdits | Remeasurement] = TypeAdapter(NewRevision)


def test_the_kind_decides_what_is_asked_for() -> None:
    edits = ADAPTER.validate_python({"kind": "edit", "take": 1, "labels": [{"triad": 0, "label": "t09"}]})
    assert isinstance(edits, TriadEdits)
    assert edits.labels[0].label == "T9"
    again = ADAPTER.validate_python({"kind": "measure", "take": 1})
    assert isinstance(again, Remeasurement)
    assert (again.parameters, again.templates) == ({}, None)


@pytest.mark.parametrize(
    "document",
    [
        {"kind": "edit", "take": 1},
        {"kind": "edit", "take": 1, "removed": [1, 1]},
        {"kind": "edit", "take": 1, "removed": [1], "labels": [{"triad": 1, "label": None}]},
        {"kind": "edit", "take": 0, "removed": [1]},
        {"kind": "edit", "take": 1, "removed": [-1]},
        {"kind": "measure", "take": 1, "removed": [1]},
        {"kind": "other", "take": 1},
    ],
)
def test_what_asks_for_nothing_or_twice_is_refused(document: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        ADAPTER.validate_python(document)
