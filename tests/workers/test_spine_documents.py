"""The document of a spine holds what the library gives, to the last bit, and says why there is none."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest

from contract.library_setup import SurgeryLevels
from contract.spine import StageSpine
from contract.spine_setup import POSITION_SD_MM, ROTATION_SD_DEG, SpineSetup
from contract.stage_reference import StageReference
from spinewatch.spine.assessment import SpineParameters, assess_stage
from spinewatch.spine.initial import initial_from_poses
from spinewatch.spine.motion import ReferenceMissingError
from spinewatch.spine.plausibility import PlausibilityParameters
from spinewatch.spine.stage_order import BaselineMissingError
from tests.spinewatch.spine.simulated import AXES, Surgery, surgery
from workers.spine_documents import SpineInputs, spine_document

OTHER = SpineParameters(plausibility=PlausibilityParameters(sigma=2.5))
CASE = surgery(11, noise=0.5)
REFERENCE = CASE.setup.reference


def setup_document(case: Surgery, **changes: Any) -> SpineSetup:
    """The setup of a simulated surgery as a document."""
    initial = case.setup.initial
    poses = [
        {"vertebra": level, "position_mm": position, "rotation": rotation}
        for level, position, rotation in zip(
            initial.levels, initial.position_mm.tolist(), initial.rotation.tolist(), strict=True
        )
    ]
    document = {
        "patient_axes": {
            "kind": "directions", "cephalad": AXES[:, 2].tolist(), "left": AXES[:, 1].tolist(),
        },
        "initial": {"kind": "poses", "frame": "object", "poses": poses[::-1]},
    }  # fmt: skip
    return SpineSetup.model_validate({**document, **changes})


def inputs(case: Surgery = CASE, **changes: Any) -> SpineInputs:
    made = SpineInputs(
        surgery_id="s",
        setup=setup_document(case),
        revision=3,
        rebaselines=(),
        levels=SurgeryLevels(case.setup.reference),
        stages=case.stages,
        references={name: StageReference(name=name, take=2, calibration_id="c") for name in case.stages},
    )
    return replace(made, **changes)


def without(stage: str, level: str) -> Mapping[str, Any]:
    poses = {name: pose for name, pose in CASE.stages[stage].items() if name != level}
    return {**CASE.stages, stage: poses}


def test_the_document_holds_the_assessment() -> None:
    found = spine_document(inputs(), "POST", "PRE", "INTER", OTHER)
    known, n = CASE.setup.initial, len(CASE.setup.initial.levels)
    initial = initial_from_poses(
        known.levels,
        known.position_mm,
        known.rotation,
        np.full(n, POSITION_SD_MM),
        np.full(n, ROTATION_SD_DEG),
        frame="object",
        patient_axes=AXES,
        triads=CASE.stages["PRE"],
    )
    case = replace(CASE.setup, initial=initial)
    expected = assess_stage(case, CASE.stages, "POST", "INTER", parameters=OTHER)
    assert (found.surgery_id, found.stage, found.take, found.setup_revision) == ("s", "POST", 2, 3)
    assert (found.baseline.name, found.reference_vertebra) == ("PRE", REFERENCE)
    assert REFERENCE in found.frame
    assert REFERENCE in found.reference_line
    for state, position in zip(found.vertebrae, expected.configuration.poses.position_mm, strict=True):
        assert state.position_mm == pytest.approx(position, abs=1e-9)
    assert found.object_to_spine is not None
    assert found.object_to_spine.rotation == expected.object_to_spine.rotation.tolist()
    assert found.object_to_spine.translation_mm == expected.object_to_spine.translation_mm.tolist()
    assert [m.value for m in found.measures] == pytest.approx(
        [None if np.isnan(m.value) else m.value for m in expected.measured.measures], abs=1e-6
    )
    assert found.since_baseline is not None
    assert found.since_previous is not None
    assert found.since_previous.since.name == "INTER"
    assert found.parameters == json.loads(json.dumps(asdict(OTHER)))
    again = StageSpine.model_validate_json(found.model_dump_json())
    assert again == found


def test_only_the_levels_of_the_setup_count() -> None:
    levels = [level for level in CASE.setup.initial.levels if level != "T9"]
    found = spine_document(inputs(setup=setup_document(CASE, levels=levels)), "POST", "PRE", "INTER", OTHER)
    (t9,) = [state for state in found.vertebrae if state.vertebra == "T9"]
    assert (t9.marked, t9.origin.value) == (False, "interpolated")


def test_another_reference_of_the_setup() -> None:
    other = CASE.setup.initial.levels[0]
    document = setup_document(CASE, reference_vertebra=other)
    found = spine_document(inputs(setup=document), "POST", "PRE", "INTER", OTHER)
    assert found.reference_vertebra == other
    (state,) = [state for state in found.vertebrae if state.vertebra == other]
    assert state.position_mm == pytest.approx([0, 0, 0], abs=1e-9)


@pytest.mark.parametrize(("stage", "words"), [("PRE", "the baseline stage PRE"), ("POST", "stage POST")])
def test_without_the_reference_there_is_no_spine(stage: str, words: str) -> None:
    with pytest.raises(ReferenceMissingError, match=f"{REFERENCE} has no pose in {words}"):
        spine_document(inputs(stages=without(stage, REFERENCE)), "POST", "PRE", "INTER", OTHER)


def test_without_a_baseline_there_is_no_spine() -> None:
    with pytest.raises(BaselineMissingError, match="EARLY has no result"):
        spine_document(inputs(), "POST", "EARLY", None, OTHER)


def test_a_target_is_in_the_document() -> None:
    document = setup_document(CASE, target=[{"vertebra": "T9", "angles_deg": [1.0, 2.0, 3.0]}])
    found = spine_document(inputs(setup=document), "POST", "PRE", "INTER", OTHER)
    assert found.remaining is not None
    assert [item.vertebra for item in found.remaining] == ["T9"]
    assert found.remaining[0].translation_mm == [None, None, None]
    assert found.target_measures is not None
