import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pydantic import ValidationError

from contract.base import Known, Known3, Matrix3, Number, Schema, Vector3, plain


class Example(Schema):
    vector: Vector3
    matrix: Matrix3 | None = None
    number: Number = 0.0
    known: Known = None
    several: Known3 | None = None


FINITE = st.floats(allow_nan=False, allow_infinity=False)


@given(arrays(np.float64, 3, elements=FINITE), arrays(np.float64, (3, 3), elements=FINITE), FINITE)
def test_arrays_pass_through_json_to_the_last_bit(
    vector: np.ndarray, matrix: np.ndarray, number: float
) -> None:
    made = Example.model_validate({"vector": vector, "matrix": matrix, "number": np.float64(number)})
    document = json.loads(json.dumps(made.model_dump(mode="json"), allow_nan=False))
    assert Example.model_validate(document) == made
    assert np.array(document["vector"]).tobytes() == vector.tobytes()
    assert np.array(document["matrix"]).tobytes() == matrix.tobytes()


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_number_that_is_not_finite_is_refused_or_null(value: float) -> None:
    with pytest.raises(ValidationError, match="finite"):
        Example.model_validate({"vector": np.array([0.0, value, 0.0])})
    several = np.array([1.0, value, 3.0])
    made = Example.model_validate({"vector": [0.0, 0.0, 0.0], "known": value, "several": several})
    assert made.known is None
    assert made.several == [1.0, None, 3.0]


@pytest.mark.parametrize(
    "vector", [[1.0, 2.0], [1.0, 2.0, 3.0, 4.0], ["1", "2", "3"], [True, 2.0, 3.0], "123", None, {}]
)
def test_nothing_is_converted(vector: object) -> None:
    with pytest.raises(ValidationError):
        Example.model_validate({"vector": vector})


def test_unknown_fields_are_refused_and_models_do_not_change() -> None:
    with pytest.raises(ValidationError):
        Example.model_validate({"vector": [1.0, 2.0, 3.0], "more": 1})
    with pytest.raises(ValidationError):
        Example(vector=[1.0, 2.0, 3.0]).number = 2.0


def test_what_the_library_holds_becomes_plain() -> None:
    assert plain((1, 2)) == [1, 2]
    assert plain(np.array([[1.0]])) == [[1.0]]
    assert type(plain(np.float64(1.5))) is float
    assert plain("text") == "text"
