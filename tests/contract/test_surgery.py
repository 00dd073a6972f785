import json
from typing import Any

import pytest
from pydantic import ValidationError

from contract.surgery import NewSurgery, Surgery
from spinewatch.levels import LevelError

(EXAMPLE,) = NewSurgery.model_json_schema()["examples"]


def test_the_example_is_a_surgery() -> None:
    assert NewSurgery.model_validate(EXAMPLE).model_dump() == EXAMPLE
    assert (
        NewSurgery.model_validate({k: v for k, v in EXAMPLE.items() if k != "spine_axis"}).spine_axis
        == "auto"
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"reference_vertebra": "T5"}, "not among vertebrae"),
        ({"vertebrae": []}, "at least 1"),
        ({"vertebrae": ["T" * 17]}, "at most 16"),
        ({"reference": ""}, "at least 1 character"),
        ({"spine_axis": "z"}, "'x', 'y' or 'auto'"),
        ({"patient_name": "x"}, "Extra"),
    ],
)
def test_what_no_surgery_can_be_is_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ValidationError, match=words):
        NewSurgery.model_validate({**EXAMPLE, **changes})


@pytest.mark.parametrize(
    ("vertebrae", "extra_levels", "words"),
    [
        (["L1", "T9", "T11", "T7"], [], "order"),
        (["L9", "T11"], [], "L9"),
        (["L1", "T77"], [], "T77"),
        (["L1", "X1"], [], "X1"),
        (["L1", "l1", "T9"], [], "twice"),
        (["L1", "L01", "T9"], [], "twice"),
        (["L1", "T13"], [], "T13"),
        (["L1", "T9"], ["T14"], "T14"),
    ],
)
def test_vertebrae_that_no_spine_has_are_refused(
    vertebrae: list[str], extra_levels: list[str], words: str
) -> None:
    with pytest.raises(LevelError, match=words):
        NewSurgery.model_validate(
            {**EXAMPLE, "vertebrae": vertebrae, "reference_vertebra": "L1", "extra_levels": extra_levels}
        )


def test_names_are_stored_in_canonical_spelling() -> None:
    surgery = NewSurgery.model_validate(
        {**EXAMPLE, "vertebrae": ["l1", "T13", "t09"], "reference_vertebra": "L01", "extra_levels": ["t13"]}
    )
    assert (surgery.vertebrae, surgery.reference_vertebra) == (["L1", "T13", "T9"], "L1")
    assert surgery.extra_levels == ["T13"]


def test_a_surgery_of_an_earlier_version_is_still_read() -> None:
    old = {"id": "1", "created_at": "2026-11-21T09:30:00Z", "stages": [], "extra_levels": []}
    fields = {**EXAMPLE, **old, "vertebrae": ["L9", "T11", "T12"], "reference_vertebra": "L9"}
    assert Surgery.model_validate_json(json.dumps(fields)).vertebrae == ["L9", "T11", "T12"]


def test_an_extra_level_is_declared_once() -> None:
    with pytest.raises(LevelError, match="extra level T13 is named twice"):
        NewSurgery.model_validate({**EXAMPLE, "extra_levels": ["T13", "t13"]})
