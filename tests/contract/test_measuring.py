import pytest
from pydantic import ValidationError

from contract.measuring import Measuring, parse_range


def test_what_is_not_stated_is_the_workers_choice() -> None:
    assert (Measuring().parameters, Measuring().models) == ({}, ())


def test_parameters_are_nested_as_in_a_result() -> None:
    given = Measuring(range_mm="630,760.5", refine=True)
    assert given.parameters == {
        "search": {"matching": {"epipolar": {"range_mm": [630.0, 760.5]}, "refinement": {"enabled": True}}}
    }


def test_markers_are_those_of_their_texts() -> None:
    given = Measuring(markers=["flat-10-14-18", "orthogonal:30,25,20"])
    assert [model.name for model in given.models] == ["flat-10-14-18", "orthogonal-30-25-20"]


@pytest.mark.parametrize(
    "values",
    [
        {"range_mm": "760,630"},
        {"range_mm": "0,630"},
        {"range_mm": "630"},
        {"markers": ["flat"]},
        {"markers": ["flat:18,14"]},
        {"markers": ["flat:18,14,inf"]},
        {"markers": ["round:18,14,10"]},
        {"markers": ["flat-10-14-18"] * 9},
        {"templates": "x" * 65},
    ],
)
def test_what_cannot_be_used_is_refused(values: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        Measuring.model_validate(values)


def test_a_range_is_two_numbers_of_which_the_first_is_nearer() -> None:
    assert parse_range("630,760") == (630.0, 760.0)
    with pytest.raises(ValueError, match="nearest and the farthest"):
        parse_range("630,630")
