"""The spine at a stage from its measured bodies: what is filled in between, first initially and then; NumPy only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.spine.bodies import Bodies, Stages, measured_bodies
from spinewatch.spine.configuration import SpinePoses, SpineSetup
from spinewatch.spine.displacements import Base, interpolation_source, spine_places
from spinewatch.spine.interpolation_model import InterpolationParameters

Fill = Callable[[SpinePoses, dict[str, Float], Base, str, InterpolationParameters], SpinePoses]
"""What fills in poses between known ones and adds their errors: known poses, errors, base, name of the source of the
interpolation's own error, and its size."""


@dataclass(frozen=True, eq=False)
class Assembled:
    """The spine at a stage.

    Attributes
    ----------
    bodies
        Bodies of the marked vertebrae.
    known
        Poses that interpolation started from: at the baseline the initial ones, at another stage the measured ones.
    base
        What changes were counted from.
    filled
        The known poses and those in between.
    errors
        Errors of the filled poses by source.
    """

    bodies: Bodies
    known: SpinePoses
    base: Base
    filled: SpinePoses
    errors: dict[str, Float]


def assemble(
    setup: SpineSetup, stages: Stages, stage: str, fill: Fill, parameters: InterpolationParameters
) -> Assembled:
    """Return the spine at a stage.

    Parameters
    ----------
    setup
        What is known of the surgery.
    stages
        Labelled poses by stage, in the order of the surgery.
    stage
        Name of the stage.
    fill
        What fills in poses between known ones.
    parameters
        Size of the errors of interpolation.

    Returns
    -------
    Assembled
        At the baseline the initial configuration with what is between its vertebrae; at another stage the measured
        bodies with the change since then of those between them.

    Raises
    ------
    StageMissingError
        If a stage is missing.
    ReferenceMissingError
        If the reference was not measured at the baseline or at this stage.
    RebaselineError
        If the reference's marker was re-clamped, or the stages of a rebaseline are not in order.
    BodiesCoincideError
        If two bodies of the initial configuration coincide.
    """
    bodies = measured_bodies(setup, stages, stage)
    places = spine_places(bodies.initial.position_mm)
    nowhere = SpinePoses(np.zeros((len(places), 3)), np.tile(np.eye(3), (len(places), 1, 1)))
    known, base = bodies.initial, Base(nowhere, {}, places)
    errors = {source: factor.copy() for source, factor in bodies.initial_errors.items()}
    filled = fill(known, errors, base, interpolation_source(setup.baseline), parameters)
    if stage != setup.baseline:
        known, base = bodies.poses, Base(filled, errors, places)
        errors = {source: factor.copy() for source, factor in bodies.errors.items()}
        filled = fill(known, errors, base, interpolation_source(stage), parameters)
    return Assembled(bodies, known, base, filled, errors)
