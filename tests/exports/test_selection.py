"""The stages that an export holds."""

from __future__ import annotations

import pytest

from contract.flag import Flag
from contract.summary import SurgerySummary
from exports.selection import (
    UnknownStageError,
    no_spine_reason,
    selected_spines,
    selected_stages,
    stage_flags,
)


def test_all_stages_by_default(summary: SurgerySummary) -> None:
    assert [stage.name for stage in selected_stages(summary, None)] == ["PRE", "INTER", "POST", "EXTRA"]
    assert [spine.stage for spine in selected_spines(summary, None)] == ["PRE", "INTER", "POST"]


def test_one_stage(summary: SurgerySummary) -> None:
    assert [stage.name for stage in selected_stages(summary, "INTER")] == ["INTER"]
    assert selected_spines(summary, "EXTRA") == []


def test_flags_are_those_of_triads_and_spine(summary: SurgerySummary) -> None:
    triads = Flag(code="triad-count-low", detail="3 of 4 triads")
    stage = summary.stages[2].model_copy(update={"flags": [triads]})
    assert [flag.code for flag in stage_flags(stage)] == ["triad-count-low", "rig-refined"]
    assert [flag.code for flag in stage_flags(stage.model_copy(update={"spine": None}))] == [
        "triad-count-low"
    ]
    assert stage_flags(summary.stages[3]) == []


def test_a_stage_without_a_spine_always_has_a_reason(summary: SurgerySummary) -> None:
    assert no_spine_reason(summary.stages[3]) == "the stage was not measured"
    silent = summary.stages[3].model_copy(update={"spine_reason": None})
    assert no_spine_reason(silent) == "the stage has not been measured"


def test_an_unknown_stage_names_the_others(summary: SurgerySummary) -> None:
    with pytest.raises(UnknownStageError, match=r"'LATER'.*PRE, INTER, POST, EXTRA"):
        selected_stages(summary, "LATER")
    with pytest.raises(UnknownStageError, match="none"):
        selected_stages(summary.model_copy(update={"stages": []}), "PRE")
