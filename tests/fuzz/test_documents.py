"""JSON documents of any content: each is taken, and then the same after a round trip, or refused by a named error."""

from __future__ import annotations

import json
from collections.abc import Callable

import pytest
from pydantic import BaseModel, ValidationError

from contract.base import Schema
from contract.spine_setup import NewRebaseline, SpineSetup
from contract.surgery import NewSurgery
from service.json_check import JSONError, check_json
from spinewatch.errors import SpinewatchError
from spinewatch.rig_files.rig_json import parse_rig, rig_from_dict, rig_to_dict
from tests.fuzz.campaign import outcome_of, run
from tests.fuzz.document_mutations import mutate
from tests.paths import SAMPLES

_SAMPLE = SAMPLES / "D1"
_SURGERY = {
    "reference": "2026-0417",
    "vertebrae": ["L1", "T11", "T9", "T7"],
    "reference_vertebra": "L1",
    "spine_axis": "x",
    "extra_levels": ["T13"],
}
_POSES = {
    "patient_axes": {"kind": "directions", "cephalad": "+x", "left": "+y"},
    "initial": {
        "kind": "poses",
        "poses": [
            {
                "vertebra": name,
                "position_mm": [30.0 * k, 1.0, 2.0],
                "coronal_deg": 3.0,
                "sagittal_deg": -4.0,
                "axial_deg": 5.0,
            }
            for k, name in enumerate(["L1", "T11", "T9", "T7"])
        ],
    },
}
_CLAMPED = {"vertebra": "T9", "before": "PRE", "after": "POST"}


def rig_outcome(data: bytes) -> str:
    try:
        rig = parse_rig(data)
    except SpinewatchError as error:
        return outcome_of(error)
    document = rig_to_dict(rig)
    assert rig_to_dict(rig_from_dict(json.loads(json.dumps(document, allow_nan=False)))) == document
    return "accepted"


def outcome_as(model: type[BaseModel]) -> Callable[[bytes], str]:
    def outcome(data: bytes) -> str:
        try:
            check_json(data)
        except JSONError as error:
            return outcome_of(error)
        try:
            found = model.model_validate_json(data)
        except ValidationError as error:
            return str(error.errors(include_input=False)[0]["type"])
        except SpinewatchError as error:
            return outcome_of(error)
        assert model.model_validate_json(found.model_dump_json()) == found
        return "accepted"

    return outcome


@pytest.mark.timeout(1200)
def test_a_rig_of_any_content_is_taken_or_refused() -> None:
    run("rigs", [(_SAMPLE / "rig.json").read_bytes()], mutate, rig_outcome)


@pytest.mark.timeout(1200)
@pytest.mark.parametrize(
    ("kind", "model", "seeds"),
    [
        ("surgeries", NewSurgery, [json.dumps(_SURGERY).encode()]),
        ("setups", SpineSetup, [(_SAMPLE / "spine.json").read_bytes(), json.dumps(_POSES).encode()]),
        ("rebaselines", NewRebaseline, [json.dumps(_CLAMPED).encode()]),
    ],
)
def test_a_document_of_any_content_is_taken_or_refused(
    kind: str, model: type[Schema], seeds: list[bytes]
) -> None:
    run(kind, seeds, mutate, outcome_as(model))
