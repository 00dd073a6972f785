"""``python -m bench.spine_figure FILE``: write the report of a simulated correction, the figure of the README."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from itertools import pairwise
from pathlib import Path

import numpy as np

from bench.spine_surgeries import STAGES, Surgery, simulated_surgery
from bench.spine_triads import measured_triads
from contract.image import Image, ImagePair
from contract.job import JobState
from contract.library_setup import SurgeryLevels
from contract.spine import StageSpine
from contract.spine_setup import SpineSetup, StoredSpineSetup
from contract.stage_reference import StageReference
from contract.summary import SummaryStage, SurgerySummary
from reports.surgery import render_surgery
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.scoliosis import LEVELS, CurveKind, Manoeuvre
from spinewatch.triads.pose import Pose
from workers.spine_documents import SpineInputs, spine_document

_ID = "simulated"
_TIME = datetime(2026, 1, 1, tzinfo=UTC)
_MANOEUVRES = (Manoeuvre(0.3, 15.0, 0.3, 5.0), Manoeuvre(0.3, 0.0, 0.2, 8.0))
_INITIAL_SD_MM, _INITIAL_SD_DEG = 1.0, 1.5
_NO_IMAGE = Image(sha256="0" * 64, media_type="image/png", width_px=1, height_px=1, size_bytes=1)


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the report; return the exit status."""
    (file,) = sys.argv[1:] if arguments is None else arguments
    Path(file).write_text(render_surgery(simulated_summary(4)), encoding="utf-8")
    return 0


def simulated_summary(seed: int) -> SurgerySummary:
    """Return the summary of a simulated correction of a thoracic curve, measured with the rig's noise."""
    rng = np.random.default_rng(seed)
    surgery = simulated_surgery(rng, CurveKind.THORACIC, manoeuvres=_MANOEUVRES, extra=("T7", "T10", "T12"))
    inputs = SpineInputs(
        surgery_id=_ID,
        setup=_setup(surgery),
        revision=1,
        rebaselines=(),
        levels=SurgeryLevels(surgery.reference),
        stages={stage: _measured(surgery, stage, rng) for stage in STAGES},
        references={stage: StageReference(name=stage, take=1, calibration_id=_ID) for stage in STAGES},
    )
    first, *_ = STAGES
    before = {first: None} | {after: earlier for earlier, after in pairwise(STAGES)}
    stages = [_stage(spine_document(inputs, stage, first, before[stage])) for stage in STAGES]
    stored = StoredSpineSetup(
        surgery_id=_ID, revision=1, created_at=_TIME, setup=inputs.setup, rebaselines=[]
    )
    return SurgerySummary(
        surgery_id=_ID,
        reference="simulated-1",
        vertebrae=list(surgery.marked),
        reference_vertebra=surgery.reference,
        created_at=_TIME,
        setup=stored,
        stages=stages,
        version=version("spinewatch"),
    )


def _setup(surgery: Surgery) -> SpineSetup:
    """Return the setup with the true initial poses of the bodies, and the deviations of radiographs."""
    bodies = surgery.bodies[STAGES[0]]
    poses = [
        {
            "vertebra": level,
            "position_mm": bodies.position_mm[i].tolist(),
            "rotation": bodies.rotation[i].tolist(),
            "position_sd_mm": _INITIAL_SD_MM,
            "rotation_sd_deg": _INITIAL_SD_DEG,
        }
        for i, level in enumerate(LEVELS)
    ]
    _, left, cephalad = surgery.patient_axes.T
    axes = {"kind": "directions", "cephalad": cephalad.tolist(), "left": left.tolist()}
    return SpineSetup.model_validate(
        {"patient_axes": axes, "initial": {"kind": "poses", "frame": "object", "poses": poses}}
    )


def _measured(surgery: Surgery, stage: str, rng: np.random.Generator) -> dict[str, Pose]:
    truth = surgery.triads[stage]
    found = measured_triads(large_rig(), list(truth.values()), rng)
    return {label: pose for label, pose in zip(truth, found, strict=True) if pose is not None}


def _stage(spine: StageSpine) -> SummaryStage:
    return SummaryStage(
        name=spine.stage,
        take=spine.take,
        calibration_id=_ID,
        state=JobState.SUCCEEDED,
        captured_at=None,
        created_at=_TIME,
        images=ImagePair(left=_NO_IMAGE, right=_NO_IMAGE),
        triads=[],
        flags=[],
        version=spine.version,
        spine=spine,
        spine_reason=None,
    )


if __name__ == "__main__":
    sys.exit(main())
