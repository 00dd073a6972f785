"""The stages that an export holds."""

from __future__ import annotations

import pytest

from contract.summary import SurgerySummary
from exports.selection import UnknownStageError, selected_spines, selected_stages


def test_all_stages_by_default(summary: SurgerySummary) -> None:
    assert [stage.name for stage in selected_stages(summary, None)] == ["PRE", "INTER", "POST", "EXTRA"]
    assert [spine.stage for spine in selected_spines(summary, None)] == ["PRE", "INTER", "POST"]


def test_one_stage(summary: SurgerySummary) -> None:
    assert [stage.name for stage in selected_stages(summary, "INTER")] == ["INTER"]
    assert selected_spines(summary, "EXTRA") == []


def test_an_unknown_stage_names_the_others(summary: SurgerySummary) -> None:
    with pytest.raises(UnknownStageError, match=r"'LATER'.*PRE, INTER, POST, EXTRA"):
        selected_stages(summary, "LATER")
    with pytest.raises(UnknownStageError, match="none"):
        selected_stages(summary.model_copy(update={"stages": []}), "PRE")
