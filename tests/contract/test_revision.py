from typing import Any

import pytest
from pydantic import TypeAdapter, ValidationError

from contract.revision import NewRevision, Relabelling, Remeasurement, RemovedCentre, TriadEdits

REMOVE = {"action": "remove", "side": "left", "feature": 3}
ADAPTER: TypeAdapter[TriadEdits | Remeasurement | Relabelling] = TypeAdapter(NewRevision)


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
        {"kind": "edit", "take": 1, "centres": [REMOVE, REMOVE]},
        {"kind": "edit", "take": 1, "centres": [{**REMOVE, "action": "move"}]},
        {"kind": "edit", "take": 1, "centres": [{**REMOVE, "action": "add"}]},
        {"kind": "edit", "take": 1, "centres": [{**REMOVE, "side": "both"}]},
    ],
)
def test_what_asks_for_nothing_or_twice_is_refused(document: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        ADAPTER.validate_python(document)


def test_a_feature_of_each_pair_and_side_is_edited_once() -> None:
    other = [REMOVE, {**REMOVE, "side": "right"}, {**REMOVE, "pair": 2}]
    edits = ADAPTER.validate_python({"kind": "edit", "take": 1, "centres": other})
    assert isinstance(edits, TriadEdits)
    assert [edit.pair for edit in edits.centres] == [1, 1, 2]
    assert all(isinstance(edit, RemovedCentre) for edit in edits.centres)
    assert isinstance(ADAPTER.validate_python({"kind": "relabel", "take": 2}), Relabelling)
