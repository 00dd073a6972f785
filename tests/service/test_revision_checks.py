from typing import Any

import pytest

from contract.revision import LabelEdit, Remeasurement, TriadEdits
from contract.triad import Triad
from service.problems import InvalidInputError
from service.revision_checks import check_edits, check_parameters
from tests.store.builders import triad

VERTEBRAE = ["L1", "T11", "T9"]
TRIADS = [Triad.model_validate(triad("L1")), Triad.model_validate(triad("T11"))]
KNOWN = {"ball_diameter_mm": 8.0, "detection": {"scales": [1.0], "field": {"alpha": 0.8}}}


def refused(
    labels: list[tuple[int, str | None]], *removed: int, is_burst: bool = False
) -> tuple[str, Any] | None:
    edits = TriadEdits(
        kind="edit",
        take=1,
        labels=[LabelEdit(triad=k, label=label) for k, label in labels],
        removed=list(removed),
    )
    try:
        check_edits(edits, TRIADS, VERTEBRAE, is_burst=is_burst)
    except InvalidInputError as error:
        return error.code, error.loc
    return None


def test_edits_that_fit_are_taken() -> None:
    assert refused([(0, "L1"), (1, "T9")]) is None
    assert refused([(0, "T11"), (1, "L1")]) is None
    assert refused([(0, "T11")], 1) is None
    assert refused([(0, None), (1, None)]) is None


def test_edits_that_do_not_fit_name_their_place() -> None:
    assert refused([(0, "L1"), (2, "T9")]) == ("unknown-triad", ["body", "labels", 1])
    assert refused([], 0, 2) == ("unknown-triad", ["body", "removed", 1])
    assert refused([(0, "T8")]) == ("invalid-label", ["body", "labels", 0])
    assert refused([(0, "T11")]) == ("invalid-label", ["body", "labels"])
    assert refused([(0, "L1")], is_burst=True) == ("burst-not-editable", ["body", "kind"])


@pytest.mark.parametrize(
    "parameters", [{}, {"ball_diameter_mm": 6.0}, {"detection": {"field": {"alpha": 0.7}, "scales": [1.1]}}]
)
def test_parameters_of_the_result_are_taken(parameters: dict[str, Any]) -> None:
    check_parameters(Remeasurement(kind="measure", take=1, parameters=parameters), KNOWN)


@pytest.mark.parametrize(
    "parameters",
    [
        {"diameter": 6.0},
        {"detection": 3},
        {"ball_diameter_mm": {"a": 1}},
        {"detection": {"field": {"beta": 1}}},
    ],
)
def test_other_parameters_are_refused(parameters: dict[str, Any]) -> None:
    with pytest.raises(InvalidInputError) as error:
        check_parameters(Remeasurement(kind="measure", take=1, parameters=parameters), KNOWN)
    assert (error.value.code, error.value.loc) == ("invalid-parameter", ["body", "parameters"])
