"""What happened between two stages: motions, changes of the measures and their attribution."""

from __future__ import annotations

from spinewatch.spine.attribution import attribute
from spinewatch.spine.changes import vertebra_changes
from spinewatch.spine.configuration import SpineConfiguration
from spinewatch.spine.measure_changes import measure_changes
from spinewatch.spine.measure_parameters import MeasureParameters
from spinewatch.spine.results import SpineChange


def compare_stages(
    before: SpineConfiguration,
    after: SpineConfiguration,
    baseline: SpineConfiguration,
    reference: str,
    parameters: MeasureParameters | None = None,
) -> SpineChange:
    """Return what happened to the spine between two stages.

    Parameters
    ----------
    before, after
        The spine at the earlier and at the later stage.
    baseline
        The spine at the baseline stage, which decides curves and vertebrae.
    reference
        The reference vertebra.
    parameters
        Numbers of the measures; None for the defaults.

    Returns
    -------
    SpineChange
        Motion of each vertebra, changes of the measures and their attribution.
    """
    return SpineChange(
        vertebrae=vertebra_changes(before, after, reference),
        measures=measure_changes(before, after, baseline, parameters),
        attribution=attribute(before, after, baseline, reference, parameters),
    )
