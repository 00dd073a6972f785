"""A small surgery with a spine at three stages, as contract models, for tests of exports, reports and routes."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

import numpy as np

from contract.flag import Flag
from contract.image import Image, ImagePair
from contract.job import JobState
from contract.pose import pose_fields
from contract.spine import (
    ORIGIN_REASON,
    Attribution,
    Curve,
    MeasureValue,
    RemainingCorrection,
    Share,
    SpineChange,
    StageSpine,
    VertebraChange,
    VertebraState,
)
from contract.spine_setup import StoredSpineSetup
from contract.stage_reference import StageReference
from contract.summary import SummaryStage, SurgerySummary
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.spine.configuration import InitialKind, Origin
from spinewatch.spine.results import MeasureStatus
from spinewatch.spine.uncertainty import normal_interval
from spinewatch.triads.pose import Pose

SURGERY = "4b1f6a52-3f0e-4c56-9d0b-0c7a5f1d2e33"
CALIBRATION = "0e9f3f7e-7a1e-4c1c-8f67-2f8e0d8f8a10"
LEVELS = ("T5", "T6", "T7", "T8", "T9", "T10", "T11", "T12", "L1", "L2")
MARKED = ("T7", "T9", "T11", "L1")
STAGES = ("PRE", "INTER", "POST")
FRAME = "patient axes at stage PRE, fixed to L1; origin at its centroid at PRE"
_START = datetime(2026, 11, 21, 9, 30, tzinfo=UTC)


def origin(level: str) -> Origin:
    if level in MARKED:
        return Origin.MEASURED
    return Origin.NOT_MEASURED if level in ("T5", "T6", "L2") else Origin.INTERPOLATED


def pose(level: str, stage: int) -> Pose:
    """A thoracic curve convex to the right that shrinks from stage to stage."""
    up = LEVELS.index("L1") - LEVELS.index(level)
    bend = 1.0 - 0.4 * stage
    lateral = -25.0 * bend * np.sin(np.pi * up / 6)
    tilt = np.radians(30.0) * bend * np.cos(np.pi * up / 6)
    R = rotation_from_vector(np.array([tilt, np.radians(2.0 * up), np.radians(3.0 * up * bend)]))
    sd = np.array([0.3, 0.3, 0.5, 0.8, 0.8, 0.4]) * (1.0 if level in MARKED else 2.0)
    if level == "L1":
        sd[:3] = 0.0
    return Pose(np.array([0.5 * up**2, lateral, 27.0 * up]), R, np.diag(sd**2))


def vertebra(level: str, stage: int) -> VertebraState:
    where = origin(level)
    measured = where is not Origin.NOT_MEASURED
    found = pose(level, stage) if measured else None
    z = None if found is None else found.rotation[:, 2]
    angles: dict[str, Any] = {
        "coronal_tilt_deg": None if z is None else float(np.degrees(np.arctan2(-z[1], z[2]))),
        "sagittal_tilt_deg": None if z is None else float(np.degrees(np.arctan2(z[0], z[2]))),
        "axial_rotation_deg": None if z is None else 4.25,
    }
    deviations: dict[str, Any] = {
        name.replace("_deg", "_sd_deg"): None if value is None else 0.8 for name, value in angles.items()
    }
    reason = None if measured else "it lies outside the marked vertebrae T7 to L1"
    bracketed = where is Origin.INTERPOLATED
    left = 0.0 if found is None else -float(found.position_mm[1])
    intervals: dict[str, Any] = {
        name.replace("_deg", "_interval_deg"): None if value is None else around(value, 0.8, bracketed)
        for name, value in angles.items()
    }
    status = MeasureStatus.BRACKETED if bracketed else MeasureStatus.MEASURED
    return VertebraState(
        **pose_fields(found, reason),
        vertebra=level,
        origin=where,
        marked=level in MARKED,
        **angles,
        **deviations,
        **intervals,
        lateral_displacement_mm=None if found is None else left,
        lateral_displacement_sd_mm=None if found is None else 0.3,
        lateral_displacement_interval_mm=None if found is None else around(left, 0.3, bracketed),
        position_reason=ORIGIN_REASON if level == "L1" else None,
        status=status if measured else MeasureStatus.NOT_MEASURED,
        bracketed_reason=f"{level} has no marker at this stage" if bracketed else None,
    )


def around(value: float, sd: float, bracketed: bool) -> list[float | None]:
    """The 95% interval of a value; another interpolation of a bracketed one is 3 less."""
    low, high = normal_interval(value, sd)
    return [low - 3.0 if bracketed else low, high]


def measure(definition: str, value: float | None, unit: str = "deg", **changes: Any) -> MeasureValue:
    fields: dict[str, Any] = {
        "definition": definition,
        "curve": "curve 1",
        "levels": ["T7", "L1"],
        "unit": unit,
        "value": value,
        "sd": None if value is None else 1.1,
        "interval": None if value is None else [value - 2.156, value + 2.156],
        "status": MeasureStatus.MEASURED,
        "assumed": False,
        "reason": None,
    }
    return MeasureValue(**{**fields, **changes})


def measures(stage: int) -> list[MeasureValue]:
    bend = 1.0 - 0.4 * stage
    not_measured: dict[str, Any] = {
        "status": MeasureStatus.NOT_MEASURED, "reason": "L5 was not measured", "curve": None,
    }  # fmt: skip
    return [
        measure("cobb-fixed", 58.3 * bend),
        measure("cobb-reselected", 59.0 * bend, levels=["T7", "T12"], status=MeasureStatus.BRACKETED,
                reason="T12 has no marker"),
        measure("apical-rotation", 14.5 * bend, levels=["T9"]),
        measure("apical-translation", 21.7 * bend, unit="mm", levels=["T9"]),
        measure("kyphosis", None, levels=["T5", "T12"], **not_measured),
        measure("lordosis", None, levels=["L1", "L5"], **not_measured),
        measure("kyphosis", 31.5 + stage, levels=["T7", "T12"], curve=None),
        measure("kyphosis", 4.5 + stage, levels=["T10", "L1"], curve=None, status=MeasureStatus.BRACKETED,
                reason="T10 has no marker"),
    ]  # fmt: skip


def change(start: int, stage: int) -> SpineChange:
    vertebrae = []
    for level in LEVELS:
        where = origin(level)
        if where is Origin.NOT_MEASURED:
            unknown: list[float | None] = [None, None, None]
            numbers: dict[str, Any] = dict.fromkeys(_ANGLES)
            vertebrae.append(VertebraChange(
                vertebra=level, origin=where, reason="it was not measured", translation_mm=unknown,
                translation_sd_mm=unknown, rotation=None, rotation_vector_deg=unknown, rotation_sd_deg=unknown,
                **numbers))  # fmt: skip
            continue
        before, after = pose(level, start), pose(level, stage)
        R = after.rotation @ before.rotation.T
        vertebrae.append(VertebraChange(
            vertebra=level, origin=where, reason=None,
            translation_mm=(after.position_mm - before.position_mm).tolist(), translation_sd_mm=[0.4, 0.4, 0.6],
            rotation=R.tolist(), rotation_vector_deg=[6.0, -1.0, 2.5], rotation_sd_deg=[1.1, 1.1, 0.6],
            angle_deg=6.6, angle_sd_deg=1.0, angle_interval_deg=[4.58, 8.55],
            derotation_deg=2.5, derotation_sd_deg=0.6, coronal_deg=6.0,
            coronal_sd_deg=1.1, sagittal_deg=-1.0, sagittal_sd_deg=1.1, distraction_mm=1.5, distraction_sd_mm=0.5,
        ))  # fmt: skip
    shares: dict[str, Any] = {
        name: Share(value=value, sd=1.0, interval=[value - 1.96, value + 1.96])
        for name, value in {"total": -23.3, "rotation": -18.0, "distraction": -5.1}.items()
    }
    qualified: dict[str, Any] = {
        "subject": "curve 1", "remainder": -0.2, "remainder_sd": 0.1, "remainder_interval": [-0.396, -0.004],
        "reason": None, "levels": ["T7", "L1"],
        "status": MeasureStatus.MEASURED, "assumed": False,
    }  # fmt: skip
    attribution = Attribution(**shares, **qualified, quantity="cobb-fixed", unit="deg")
    apex = {**qualified, "levels": ["T8"], "status": MeasureStatus.BRACKETED, "reason": "T8 has no marker"}
    return SpineChange(
        since=reference(start),
        vertebrae=vertebrae,
        measures=[
            measure("cobb-fixed", -23.3),
            measure("kyphosis", 1.25, levels=["T7", "T12"], curve=None),
            measure("kyphosis", -0.75, levels=["T10", "L1"], curve=None, status=MeasureStatus.BRACKETED,
                    reason="T10 has no marker"),
        ],
        attribution=[
            attribution,
            Attribution(**{**shares, **apex}, quantity="apical-translation", unit="mm"),
        ],
    )  # fmt: skip


_ANGLES = (
    "angle_deg", "angle_sd_deg", "derotation_deg", "derotation_sd_deg", "coronal_deg", "coronal_sd_deg",
    "sagittal_deg", "sagittal_sd_deg", "distraction_mm", "distraction_sd_mm",
)  # fmt: skip


def reference(stage: int) -> StageReference:
    return StageReference(name=STAGES[stage], take=1, calibration_id=CALIBRATION)


def stage_spine(stage: int = 1) -> StageSpine:
    """Return the spine at the stage of a number, 0 to 2."""
    remaining = RemainingCorrection(
        vertebra="T9", coronal_deg=-1.0, sagittal_deg=0.5, axial_deg=-3.0, sd_deg=[0.8, 0.8, 0.4],
        translation_mm=[None, None, None], translation_sd_mm=[None, None, None],
    )  # fmt: skip
    return StageSpine(
        surgery_id=SURGERY,
        stage=STAGES[stage],
        take=1,
        setup_revision=1,
        frame=FRAME,
        reference_vertebra="L1",
        reference_line="line along the patient's z axis through the centroid of L1",
        initial=InitialKind.POSES,
        baseline=reference(0),
        vertebrae=[vertebra(level, stage) for level in LEVELS],
        curves=[Curve(name="curve 1", upper="T7", apex="T9", lower="L1", side="right", open_ends=["L1"])],
        measures=measures(stage),
        since_baseline=change(0, stage) if stage else None,
        since_previous=change(stage - 1, stage) if stage else None,
        remaining=[remaining],
        target_measures=[measure("cobb-fixed", -5.0)],
        flags=[Flag(code="rig-refined", detail="an example of a flag")] if stage == 2 else [],
        parameters={},
        version="0.2.0",
    )


def summary() -> SurgerySummary:
    """Return the whole surgery; a fourth stage has failed and has no result."""
    image = Image(sha256="ab" * 32, media_type="image/png", width_px=568, height_px=416, size_bytes=1000)
    stages = [
        SummaryStage(
            name=name, take=1, calibration_id=CALIBRATION, state=JobState.SUCCEEDED, captured_at=_START,
            created_at=_START, images=ImagePair(left=image, right=image), triads=[], flags=[], version="0.2.0",
            spine=stage_spine(index), spine_reason=None,
        )
        for index, name in enumerate(STAGES)
    ]  # fmt: skip
    failed = stages[0].model_copy(
        update={
            "name": "EXTRA", "state": JobState.FAILED, "triads": None, "flags": None, "version": None,
            "spine": None, "spine_reason": "the stage was not measured",
        }
    )  # fmt: skip
    setup = StoredSpineSetup.model_validate_json(_SETUP)
    return SurgerySummary(
        surgery_id=SURGERY, reference="2026-0417", vertebrae=list(MARKED[::-1]), reference_vertebra="L1",
        created_at=_START, setup=setup, stages=[*stages, failed], version="0.2.0",
    )  # fmt: skip


_SETUP = f"""{{"surgery_id": "{SURGERY}", "revision": 1, "created_at": "2026-11-21T09:00:00Z", "rebaselines": [],
  "setup": {{"patient_axes": {{"kind": "directions", "cephalad": "+x", "left": "+y"}},
    "initial": {{"kind": "generic"}}}}}}"""
