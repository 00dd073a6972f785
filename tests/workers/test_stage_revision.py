from typing import Any

import pytest

from spinewatch.detection.candidates.templates import default_template_set
from spinewatch.errors import ParameterError
from spinewatch.parameters import Parameters
from tests.store.builders import stage_result
from workers.stage_revision import (
    UnknownTemplatesError,
    changed_parameters,
    changes_text,
    chosen_templates,
    parameters_of,
    revised_parameters,
    with_changes,
)


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


def test_parameters_of_a_result_are_those_of_the_method() -> None:
    result = stage_result(parameters={"ball_diameter_mm": 6.0, "calibration_max_age_days": 1.0})
    assert parameters_of(result) == {"ball_diameter_mm": 6.0}


def test_changes_are_added_to_what_was_sent() -> None:
    sent = {"search": {"matching": {"epipolar": {"range_mm": [630.0, 760.0]}}}}
    wanted = {"search": {"matching": {"refinement": {"enabled": True}}}, "ball_diameter_mm": 6.0}
    both = with_changes(sent, wanted)
    assert both["search"]["matching"] == {
        "epipolar": {"range_mm": [630.0, 760.0]},
        "refinement": {"enabled": True},
    }
    assert both["ball_diameter_mm"] == 6.0
    assert with_changes(sent, {"search": {"matching": {"epipolar": {"range_mm": [1.0, 2.0]}}}}) != sent
    assert sent["search"]["matching"] == {"epipolar": {"range_mm": [630.0, 760.0]}}


def test_changed_parameters_are_named_with_their_values() -> None:
    usual = {"a": 1.0, "b": {"c": [1, 2], "d": True, "e": None}}
    used = {"a": 1, "b": {"c": [1, 3], "d": False, "e": None}}
    changed = changed_parameters(used, usual)
    assert changed == {"b.c": ([1, 3], [1, 2]), "b.d": (False, True)}
    assert changes_text(changed) == "b.c, b.d (false instead of true)"
    assert changed_parameters(usual, usual) == {}
