import pytest
from pydantic import ValidationError

from contract.stage_reference import StageReference


def test_a_reference_names_stage_take_and_calibration() -> None:
    made = StageReference(name="PRE", take=2, calibration_id="c")
    assert StageReference.model_validate_json(made.model_dump_json()) == made


@pytest.mark.parametrize("changes", [{"name": "a b"}, {"take": "1"}, {"calibration_id": ""}])
def test_what_is_no_reference(changes: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        StageReference.model_validate({"name": "PRE", "take": 1, "calibration_id": "c", **changes})
