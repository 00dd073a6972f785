"""What the ``extras`` of a glTF say: of the file, of its stages and of each vertebra; mm and degrees."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from contract.spine import VertebraState
from contract.summary import SummaryStage, SurgerySummary
from exports.definitions import definition_table, definitions_of
from exports.selection import no_spine_reason, stage_flags
from exports.text import single_line

Extras = dict[str, Any]


def level_extras(level: str, stages: Sequence[str], states: Sequence[VertebraState | None]) -> Extras:
    """Return what the node of a vertebra says.

    Parameters
    ----------
    level
        Name of the vertebra.
    stages
        Names of the stages with a spine.
    states
        The vertebra at each of them; None where the spine does not have it.

    Returns
    -------
    dict
        Its origin at the last stage, and its poses and measures at each.
    """
    found = [
        {"stage": stage, **state.model_dump(mode="json", exclude={"normal", "angles_deg", "covariance"})}
        for stage, state in zip(stages, states, strict=True)
        if state is not None
    ]
    latest = states[-1]
    return {
        "vertebra": level,
        "origin": None if latest is None else latest.origin.value,
        "units": {"position": "mm", "angle": "deg"},
        "stages": [_cleaned(stage) for stage in found],
    }


def scene_extras(stages: Sequence[SummaryStage]) -> Extras:
    """Return what the scene says.

    Parameters
    ----------
    stages
        The stages of the file, oldest first.

    Returns
    -------
    dict
        Every stage, the name of the one that is shown at rest, and the definitions of the measures.
    """
    spines = [found.spine for found in stages if found.spine is not None]
    return {
        "stages": [stage_extras(found) for found in stages],
        "shown_at_rest": spines[-1].stage if spines else None,
        "definitions": definition_table(definitions_of(spines)),
    }


def stage_extras(stage: SummaryStage) -> Extras:
    """Return what is said of a stage.

    Parameters
    ----------
    stage
        The stage.

    Returns
    -------
    dict
        Its flags, and its curves with their open ends and its measures, or the reason why it has no spine.
    """
    of_stage = {
        "stage": stage.name,
        "take": stage.take,
        "flags": [single_line(flag.code) for flag in stage_flags(stage)],
    }
    spine = stage.spine
    if spine is None:
        return {**of_stage, "spine_reason": single_line(no_spine_reason(stage))}
    return {
        **of_stage,
        "frame": single_line(spine.frame),
        "initial": spine.initial.value,
        "curves": [_cleaned(curve.model_dump(mode="json")) for curve in spine.curves],
        "measures": [_cleaned(value.model_dump(mode="json")) for value in spine.measures],
    }


def asset_extras(summary: SurgerySummary) -> Extras:
    """Return what the file says of itself.

    Parameters
    ----------
    summary
        The surgery.

    Returns
    -------
    dict
        Surgery, version, axes, colours and sizes.
    """
    return {
        "surgery_id": single_line(summary.surgery_id),
        "version": single_line(summary.version),
        "axes": "x to the patient's left, y cephalad, z anterior; metres",
        "colours": "measured blue, interpolated orange, assumed purple; axes x vermilion, y bluish green, z blue",
        "size": "vertebrae have nominal sizes; only their poses are measured",
    }


def _cleaned(fields: Extras) -> Extras:
    return {name: single_line(value) if isinstance(value, str) else value for name, value in fields.items()}
