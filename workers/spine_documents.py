"""The spine of a stage as a document, from the setup's document and the poses of the triads; without a database."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from importlib.metadata import version

from pydantic_core import to_jsonable_python

from contract.flag import Flag
from contract.library_setup import SurgeryLevels, library_setup, marked_poses
from contract.spine import StageSpine
from contract.spine_setup import NewRebaseline, SpineSetup, planned_vertebrae
from contract.stage_reference import StageReference
from spinewatch.spine.assessment import SpineParameters, assess_stage
from spinewatch.spine.motion import ReferenceMissingError
from spinewatch.spine.radiograph_landmarks import RadiographView
from spinewatch.spine.stage_order import require_baseline
from spinewatch.triads.pose import Pose

_VERSION = version("spinewatch")


@dataclass(frozen=True)
class SpineInputs:
    """What the spines of a surgery are computed from.

    Attributes
    ----------
    surgery_id
        Identifier of the surgery.
    setup
        The setup.
    revision
        Number of its revision.
    rebaselines
        Markers that were clamped again.
    levels
        The vertebrae of the surgery.
    stages
        Poses of the labelled triads by name of the stage, in the order of the stages, object space of each.
    references
        Take and calibration of each measured stage by name.
    radiographs
        Views of the surgery's radiographs by identifier.
    """

    surgery_id: str
    setup: SpineSetup
    revision: int
    rebaselines: Sequence[NewRebaseline]
    levels: SurgeryLevels
    stages: Mapping[str, Mapping[str, Pose]]
    references: Mapping[str, StageReference]
    radiographs: Mapping[str, RadiographView] = field(default_factory=dict)


def spine_document(
    inputs: SpineInputs,
    stage: str,
    baseline: str,
    previous: str | None,
    parameters: SpineParameters | None = None,
) -> StageSpine:
    """Return the spine of a stage.

    Parameters
    ----------
    inputs
        Setup, stages and radiographs.
    stage
        Name of the stage.
    baseline
        Name of the baseline stage.
    previous
        Name of the stage before, of those with a pose of the reference triad; None for the first one.
    parameters
        All numbers of the method.

    Returns
    -------
    StageSpine
        The document.

    Raises
    ------
    SpinewatchError
        There is no spine of this stage; the message says why.
    """
    p = parameters or SpineParameters()
    reference = inputs.setup.reference_vertebra or inputs.levels.reference_vertebra
    _require_reference(inputs, reference, stage, baseline)
    stages = {name: marked_poses(inputs.setup, poses) for name, poses in inputs.stages.items()}
    setup, doubts = library_setup(
        inputs.setup, inputs.rebaselines, inputs.levels, baseline, stages[baseline], inputs.radiographs
    )
    target = planned_vertebrae(inputs.setup)
    assessment = assess_stage(setup, stages, stage, previous, target, p)
    return StageSpine.of(
        assessment,
        setup.initial.kind,
        inputs.references[baseline],
        None if previous is None else inputs.references[previous],
        reference,
        surgery_id=inputs.surgery_id,
        stage=stage,
        take=inputs.references[stage].take,
        setup_revision=inputs.revision,
        flags=Flag.of([*doubts, *assessment.flags]),
        parameters=to_jsonable_python(asdict(p)),
        version=_VERSION,
    )


def _require_reference(inputs: SpineInputs, reference: str, stage: str, baseline: str) -> None:
    require_baseline(baseline, reference, inputs.stages[baseline] if baseline in inputs.references else None)
    if reference not in inputs.stages[stage]:
        raise ReferenceMissingError(
            f"the reference triad {reference} has no pose in stage {stage}; label it there or take the stage again, or"
            " name another reference_vertebra in the setup"
        )
