import pytest
from pydantic import ValidationError

from commands.shared.validation import first_problem
from contract.surgery import NewSurgery


def test_the_first_problem_is_named_with_its_place_but_not_its_content() -> None:
    with pytest.raises(ValidationError) as caught:
        NewSurgery.model_validate({"reference": 12345, "vertebrae": []})
    assert first_problem(caught.value) == "reference: Input should be a valid string"
