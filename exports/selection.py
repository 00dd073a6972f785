"""Which stages of a surgery an export holds."""

from __future__ import annotations

from contract.flag import Flag
from contract.spine import StageSpine
from contract.summary import SummaryStage, SurgerySummary
from spinewatch.errors import ParameterError


class UnknownStageError(ParameterError):
    """A stage that the surgery does not have."""

    code = "unknown-stage"


def selected_stages(summary: SurgerySummary, stage: str | None) -> list[SummaryStage]:
    """Return the stages that an export holds.

    Parameters
    ----------
    summary
        The surgery.
    stage
        Name of one stage; None for all.

    Returns
    -------
    list of SummaryStage
        The stages, oldest first.

    Raises
    ------
    UnknownStageError
        If the surgery has no stage of that name.
    """
    if stage is None:
        return list(summary.stages)
    found = [candidate for candidate in summary.stages if candidate.name == stage]
    if not found:
        names = ", ".join(candidate.name for candidate in summary.stages) or "none"
        raise UnknownStageError(f"the surgery has no stage {stage!r}; name one of its stages: {names}")
    return found


def no_spine_reason(stage: SummaryStage) -> str:
    """Return why a stage has no spine.

    Parameters
    ----------
    stage
        A stage without a spine.

    Returns
    -------
    str
        The reason, without a full stop.
    """
    return stage.spine_reason or "the stage has not been measured"


def stage_flags(stage: SummaryStage) -> list[Flag]:
    """Return the flags of a stage: of its triads, and of its spine if it has one.

    Parameters
    ----------
    stage
        The stage.

    Returns
    -------
    list of Flag
        Those of the triads first.
    """
    return [*(stage.flags or ()), *(stage.spine.flags if stage.spine is not None else ())]


def selected_spines(summary: SurgerySummary, stage: str | None) -> list[StageSpine]:
    """Return the spines that an export holds; a stage without a spine is named beside them with its reason.

    Parameters
    ----------
    summary
        The surgery.
    stage
        Name of one stage; None for all.

    Returns
    -------
    list of StageSpine
        The spines, oldest first; empty when none is known yet.

    Raises
    ------
    UnknownStageError
        If the surgery has no stage of that name.
    """
    return [found.spine for found in selected_stages(summary, stage) if found.spine is not None]
