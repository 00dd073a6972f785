from typing import Any

import pytest
from pydantic import ValidationError

from contract.surgery import NewSurgery

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
        ({"vertebrae": ["L1", "L1"]}, "names one twice"),
        ({"reference_vertebra": "T5"}, "not among vertebrae"),
        ({"vertebrae": []}, "at least 1"),
        ({"vertebrae": ["X1"]}, "pattern"),
        ({"reference": ""}, "at least 1 character"),
        ({"spine_axis": "z"}, "'x', 'y' or 'auto'"),
        ({"patient_name": "x"}, "Extra"),
    ],
)
def test_what_no_surgery_can_be_is_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(ValidationError, match=words):
        NewSurgery.model_validate({**EXAMPLE, **changes})
