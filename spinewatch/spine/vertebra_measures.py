"""Measures of every single vertebra: coronal and sagittal tilt, axial rotation, lateral displacement."""

from __future__ import annotations

from spinewatch.spine.configuration import SpineConfiguration
from spinewatch.spine.evaluation import MeasureRequest, bracketed_levels, evaluate
from spinewatch.spine.measure_parameters import MeasureParameters
from spinewatch.spine.measures import stage_value
from spinewatch.spine.results import MeasureValue
from spinewatch.spine.uncertainty import common_factors

VERTEBRA_MEASURES = ("coronal-tilt", "sagittal-tilt", "axial-rotation", "lateral-displacement")
"""Identifiers of their definitions, in the order of the report."""


def vertebra_measures(
    configuration: SpineConfiguration, parameters: MeasureParameters | None = None
) -> tuple[MeasureValue, ...]:
    """Return tilts, axial rotation and lateral displacement of every vertebra.

    Parameters
    ----------
    configuration
        The spine at a stage.
    parameters
        Numbers of the method; None for the defaults.

    Returns
    -------
    tuple of MeasureValue
        Four per vertebra in the order of `VERTEBRA_MEASURES`, cranial first; ``levels`` names the vertebra.
    """
    parameters = parameters or MeasureParameters()
    (factor,) = common_factors((configuration,))
    bracketed = bracketed_levels(configuration)
    requests = [
        MeasureRequest(definition, None, (level,))
        for level in configuration.levels
        for definition in VERTEBRA_MEASURES
    ]
    return tuple(
        stage_value(
            request,
            evaluate(request, configuration, factor, bracketed),
            assumed=configuration.assumed,
            parameters=parameters,
        )
        for request in requests
    )
