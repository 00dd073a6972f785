from typing import Any

import pytest

from contract.revision import (
    AddedCentre,
    CentreEdit,
    LabelEdit,
    MovedCentre,
    Remeasurement,
    RemovedCentre,
    TriadEdits,
)
from contract.triad import Triad
from service.problems import InvalidInputError
from service.revision_checks import EditedPair, check_centres, check_edits, check_parameters
from tests.store.builders import stage_result, triad

VERTEBRAE = ["L1", "T11", "T9"]
TRIADS = [Triad.model_validate(triad("L1")), Triad.model_validate(triad("T11"))]
KNOWN = {"ball_diameter_mm": 8.0, "detection": {"scales": [1.0], "field": {"alpha": 0.8}}}


def refused(labels: list[tuple[int, str | None]], *removed: int) -> tuple[str, Any] | None:
    edits = TriadEdits(
        kind="edit",
        take=1,
        labels=[LabelEdit(triad=k, label=label) for k, label in labels],
        removed=list(removed),
    )
    try:
        check_edits(edits, TRIADS, VERTEBRAE)
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


@pytest.mark.parametrize(
    "parameters", [{}, {"ball_diameter_mm": 6.0}, {"detection": {"field": {"alpha": 0.7}, "scales": [1.1]}}]
)
def test_parameters_of_the_result_are_taken(parameters: dict[str, Any]) -> None:
    check_parameters(Remeasurement(kind="measure", take=1, parameters=parameters), KNOWN, KNOWN)


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
        check_parameters(Remeasurement(kind="measure", take=1, parameters=parameters), KNOWN, KNOWN)
    assert (error.value.code, error.value.loc) == ("invalid-parameter", ["body", "parameters"])


def test_the_range_of_a_parameter_is_that_of_the_workers_own() -> None:
    changed = {"ball_diameter_mm": 8000.0, "new": 1.0}
    wanted = Remeasurement(kind="measure", take=2, parameters={"ball_diameter_mm": 0.01, "new": 5.0})
    check_parameters(wanted, changed, {"ball_diameter_mm": 8.0})
    with pytest.raises(
        InvalidInputError, match=r"ball_diameter_mm must be a number from 8 to 8e\+06"
    ) as error:
        check_parameters(wanted, changed, changed)
    assert (error.value.code, error.value.loc) == ("invalid-parameter", ["body", "parameters"])


PAIR = EditedPair(stage_result().features, {"left": (568, 416), "right": (568, 416)})
ADD = AddedCentre(action="add", side="left", x=0.0, y=0.0)


def centre_problem(edit: CentreEdit, pair: EditedPair | None = PAIR) -> tuple[str, Any] | None:
    try:
        check_centres([ADD, edit], {1: PAIR, edit.pair: pair})
    except InvalidInputError as error:
        return error.code, error.loc
    return None


def test_centres_inside_the_image_and_known_features_are_taken() -> None:
    assert centre_problem(AddedCentre(action="add", side="right", x=-0.5, y=415.5)) is None
    assert centre_problem(MovedCentre(action="move", side="left", feature=1, x=567.4, y=3.0)) is None
    assert centre_problem(RemovedCentre(action="remove", side="right", feature=0)) is None


def test_centres_that_do_not_fit_name_their_place() -> None:
    outside = AddedCentre(action="add", side="left", x=768.0, y=10.0)
    assert centre_problem(outside) == ("centre-outside-image", ["body", "centres", 1])
    above = MovedCentre(action="move", side="left", feature=0, x=10.0, y=-0.6)
    assert centre_problem(above) == ("centre-outside-image", ["body", "centres", 1])
    unknown = RemovedCentre(action="remove", side="right", feature=1)
    assert centre_problem(unknown) == ("unknown-feature", ["body", "centres", 1])
    second = AddedCentre(action="add", pair=2, side="left", x=1.0, y=1.0)
    assert centre_problem(second, None) == ("unknown-pair", ["body", "centres", 1])
    lost = EditedPair(None, PAIR.sizes)
    assert centre_problem(second, lost) == ("features-missing", ["body", "centres", 1])
