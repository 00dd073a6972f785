"""Labels of a stage after a person has decided on some: whether the places of the triads contradict them."""

from __future__ import annotations

from dataclasses import replace

from contract.flag import Flag
from spinewatch.stage import StageRequest
from spinewatch.triads.known_configuration import KnownConfiguration
from spinewatch.triads.labels import LabelledTriad
from spinewatch.triads.manual_labels import LEVELS_IMPLAUSIBLE, manual_label_flags
from store.measurements import MeasuredStage
from store.stage_work import LabelledStage
from workers.stage_edits import measured_triad, position_mm


def check_manual_labels(
    measured: MeasuredStage, request: StageRequest, earlier: LabelledStage | None
) -> MeasuredStage:
    """Return a result whose flags say whether the labels that a person gave are implausible.

    Parameters
    ----------
    measured
        The result of a revision.
    request
        Vertebrae in their order, and the spine axis.
    earlier
        The latest earlier stage with all labels, if any: what its distances explain is plausible.

    Returns
    -------
    MeasuredStage
        The labels as the person gave them. Without a label of a person, the flags are as they were.
    """
    result = measured.result
    if not any(triad.label_manual and triad.label is not None for triad in result.triads):
        return measured
    found = manual_label_flags(
        [
            LabelledTriad(triad.label, triad.label_reason, measured_triad(triad))
            for triad in result.triads
            if position_mm(triad) is not None
        ],
        request.labels,
        request.spine_axis,
        known=None if earlier is None else KnownConfiguration(poses=earlier.poses),
        extra_levels=request.extra_levels,
    )
    kept = [flag for flag in result.flags if flag.code != LEVELS_IMPLAUSIBLE]
    return replace(measured, result=result.model_copy(update={"flags": [*kept, *Flag.of(found)]}))
