from typing import Any

import pytest

from contract.revision import LabelEdit, TriadEdits
from contract.stage import StageResult
from spinewatch.detection.candidates.templates import default_template_set
from spinewatch.errors import ParameterError
from spinewatch.pipeline import Parameters
from tests.store.builders import stage_result, triad
from workers.stage_revision import UnknownTemplatesError, chosen_templates, edited, revised_parameters

VERTEBRAE = ("L1", "T11", "T9", "T7")
UNCERTAIN = {"code": "labels-uncertain", "detail": "which?"}
OTHER = {"code": "ball-occluded", "detail": "XX"}


def edit(result: StageResult, labels: dict[int, str | None], *removed: int) -> StageResult:
    listed = [LabelEdit(triad=k, label=label) for k, label in labels.items()]
    return edited(result, TriadEdits(kind="edit", take=1, labels=listed, removed=list(removed)), VERTEBRAE)


def unlabelled(number: int) -> dict[str, Any]:
    return {**triad("L1"), "label": None, "label_reason": f"not certain {number}"}


def test_labels_are_set_and_triads_are_in_their_order() -> None:
    result = stage_result([unlabelled(0), unlabelled(1), unlabelled(2)], flags=[UNCERTAIN, OTHER])
    after = edit(result, {0: "T9", 2: "L1"})
    assert [(t.label, t.label_reason) for t in after.triads] == [
        ("L1", None),
        ("T9", None),
        (None, "not certain 1"),
    ]
    assert [flag.code for flag in after.flags] == ["labels-uncertain", "ball-occluded"]
    whole = edit(result, {0: "T9", 2: "L1"}, 1)
    assert [t.label for t in whole.triads] == ["L1", "T9"]
    assert [flag.code for flag in whole.flags] == ["ball-occluded"]


def test_a_label_is_taken_away_with_a_reason() -> None:
    after = edit(stage_result(), {0: None})
    assert [t.label for t in after.triads] == ["T11", None]
    assert after.triads[1].label_reason == "the label was taken away by a person"


def test_everything_else_stays_as_it_was_measured() -> None:
    before = stage_result()
    after = edit(before, {0: "L1"})
    assert after == before


def test_parameters_are_replaced_one_by_one() -> None:
    own = Parameters()
    revised = revised_parameters(own, {"ball_diameter_mm": 6.0, "detection": {"field": {"alpha": 0.7}}})
    assert (revised.ball_diameter_mm, revised.detection.field.alpha) == (6.0, 0.7)
    assert revised.centres == own.centres
    assert revised_parameters(own, {}) == own


@pytest.mark.parametrize(
    "changes",
    [
        {"colour": 1},
        {"detection": {"colour": 1}},
        {"detection": 1},
        {"ball_diameter_mm": {}},
        {"ball_diameter_mm": "a"},
    ],
)
def test_parameters_that_do_not_exist_are_refused(changes: dict[str, Any]) -> None:
    with pytest.raises(ParameterError):
        revised_parameters(Parameters(), changes)


def test_templates_are_chosen_by_their_version() -> None:
    own = default_template_set()
    assert chosen_templates(None, own) is own
    assert chosen_templates(own.version, own) is own
    with pytest.raises(UnknownTemplatesError, match=own.version):
        chosen_templates("1066", own)
