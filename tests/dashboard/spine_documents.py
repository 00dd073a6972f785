"""A made-up surgery of any number of stages, as the documents that the page asks for: a curve that straightens."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np

from contract.image import Image, ImagePair
from contract.job import JobState
from contract.pose import FrameTransform, pose_fields
from contract.spine import Curve, StageSpine, VertebraState
from contract.spine_setup import StoredSpineSetup
from contract.stage_reference import StageReference
from contract.summary import SummaryStage, SurgerySummary
from contract.triad import Ball, Triad
from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.spine.configuration import InitialKind, Origin
from spinewatch.spine.orientation import rotation_from_tilts
from spinewatch.triads.pose import Pose

SURGERY = "7d0a8f3e-52c1-4a0e-9c6d-3f1b2a4c5d6e"
CALIBRATION = "0e9f3f7e-7a1e-4c1c-8f67-2f8e0d8f8a10"
LEVELS = (*(f"T{n}" for n in range(1, 13)), *(f"L{n}" for n in range(1, 6)))
MARKED = ("T1", "T4", "T7", "T9", "T11", "L1", "L3", "L5")
REFERENCE = "L5"
_START = datetime(2026, 11, 21, 9, 30, tzinfo=UTC)
_TO_SPINE = FrameTransform(
    rotation=rotation_from_vector(np.array([0.2, -1.3, 0.4])).tolist(), translation_mm=[-420.0, 310.0, 95.0]
)
_TRIAD_ON_BODY = np.array([[0.0, 0, -1], [1, 0, 0], [0, -1, 0]])
"""Axes of a triad in those of its vertebra: its normal faces backwards."""
_BALLS = {"XX": (18.0, 0.0, 0.0), "YY": (0.0, -14.0, 0.0), "MX": (-10.0, 0.0, 0.0)}


def body_pose(level: str, bend: float) -> Pose:
    """A vertebra of a spine with a right thoracic curve; ``bend`` is 1 before the correction, 0 for a straight one."""
    up, step = 1 - LEVELS.index(level) / (len(LEVELS) - 1), 1e-4
    z = _centre_line(up + step, bend) - _centre_line(up - step, bend)
    position = _centre_line(up, bend) - _centre_line(0.0, bend)
    coronal, sagittal = np.degrees(np.arctan2([-z[1], z[0]], z[2]))
    sd = np.array([0.4, 0.4, 0.6, 0.9, 0.9, 0.5]) * (1.0 if level in MARKED else 3.0)
    return Pose(position, rotation_from_tilts(coronal, sagittal, 0.45 * position[1]), np.diag(sd**2))


def _centre_line(up: float, bend: float) -> Float:
    """The line of the centroids, patient axes, mm; ``up`` is 0 at L5 and 1 at T1."""
    main, below = np.exp(-(((up - 0.6) / 0.19) ** 2)), np.exp(-(((up - 0.2) / 0.14) ** 2))
    return np.array([26 * np.sin(2 * np.pi * (0.92 - up)), bend * (16 * below - 46 * main), 430 * up])


def vertebra(
    level: str, bend: float, missing: Sequence[str] = (), assumed: Sequence[str] = ()
) -> VertebraState:
    pose = None if level in missing else body_pose(level, bend)
    origin = Origin.MEASURED if level in MARKED else Origin.INTERPOLATED
    if level in assumed:
        origin = Origin.ASSUMED
    z = None if pose is None else pose.rotation[:, 2]
    tilts: dict[str, Any] = {
        "coronal_tilt_deg": None if z is None else float(np.degrees(np.arctan2(-z[1], z[2]))),
        "sagittal_tilt_deg": None if z is None else float(np.degrees(np.arctan2(z[0], z[2]))),
        "axial_rotation_deg": None if pose is None else 0.45 * float(pose.position_mm[1]),
    }
    deviations: dict[str, Any] = {
        name.replace("_deg", "_sd_deg"): None if value is None else 0.8 for name, value in tilts.items()
    }
    return VertebraState(
        **pose_fields(pose, "it lies outside the marked vertebrae" if pose is None else None),
        vertebra=level,
        origin=Origin.NOT_MEASURED if pose is None else origin,
        marked=pose is not None and level in MARKED,
        **tilts,
        **deviations,
        lateral_displacement_mm=None if pose is None else -float(pose.position_mm[1]),
        lateral_displacement_sd_mm=None if pose is None else 0.4,
    )


def triad(level: str, bend: float) -> Triad:
    body = body_pose(level, bend)
    R, t = np.array(_TO_SPINE.rotation), np.array(_TO_SPINE.translation_mm)
    on_spine = body.position_mm + body.rotation @ np.array([-58.0, 0.0, 4.0])
    rotation = R.T @ body.rotation @ _TRIAD_ON_BODY
    pose = Pose(R.T @ (on_spine - t), rotation, np.diag(np.array([0.1, 0.1, 0.2, 0.5, 0.5, 0.3]) ** 2))
    balls = {
        name: Ball(
            position_mm=(pose.position_mm + rotation @ np.array(place)).tolist(),
            sd_mm=[0.1, 0.1, 0.2],
            left=[100.0, 100.0],
            right=None if (level, name) == ("T9", "YY") else [90.0, 100.0],
            parallax_mm=0.05,
        )
        for name, place in _BALLS.items()
    }
    return Triad(
        label=level,
        label_reason=None,
        model="flat-10-14-18",
        **pose_fields(pose, None),
        error_mm=0.1,
        balls=balls,
    )


def stage_spine(
    name: str, bend: float, first: str, missing: Sequence[str] = (), assumed: Sequence[str] = ()
) -> StageSpine:
    return StageSpine(
        surgery_id=SURGERY,
        stage=name,
        take=1,
        setup_revision=1,
        frame=f"patient axes at stage {first}, fixed to {REFERENCE}; origin at its centroid at {first}",
        object_to_spine=_TO_SPINE,
        reference_vertebra=REFERENCE,
        reference_line=f"line along the patient's z axis through the centroid of {REFERENCE} at {first}",
        initial=InitialKind.POSES,
        baseline=StageReference(name=first, take=1, calibration_id=CALIBRATION),
        vertebrae=[vertebra(level, bend, missing, assumed) for level in LEVELS],
        curves=[Curve(name="curve 1", upper="T5", apex="T8", lower="L1", side="right", open_ends=[])],
        measures=[],
        since_baseline=None,
        since_previous=None,
        remaining=None,
        target_measures=None,
        flags=[],
        parameters={},
        version="0.2.0",
    )


def surgery_summary(
    names: Sequence[str],
    missing: Sequence[str] = (),
    *,
    assumed: Sequence[str] = (),
    target_bend: float | None = None,
) -> SurgerySummary:
    """Return the summary of a surgery whose curve shrinks from stage to stage to a third."""
    image = Image(sha256="ab" * 32, media_type="image/png", width_px=568, height_px=416, size_bytes=1000)
    bends = np.linspace(1.0, 0.33, len(names)).tolist()
    stages = [
        SummaryStage(
            name=name, take=1, calibration_id=CALIBRATION, state=JobState.SUCCEEDED,
            captured_at=_START + timedelta(minutes=5 * k), created_at=_START + timedelta(minutes=5 * k),
            images=ImagePair(left=image, right=image),
            triads=[triad(level, bend) for level in MARKED if level not in missing],
            flags=[], version="0.2.0", spine=stage_spine(name, bend, names[0], missing, assumed),
            spine_reason=None,
        )
        for k, (name, bend) in enumerate(zip(names, bends, strict=True))
    ]  # fmt: skip
    return SurgerySummary(
        surgery_id=SURGERY, reference="2026-0417", vertebrae=list(MARKED), reference_vertebra=REFERENCE,
        created_at=_START, setup=_setup(target_bend), stages=stages, version="0.2.0",
    )  # fmt: skip


def _setup(target_bend: float | None) -> StoredSpineSetup:
    target = None if target_bend is None else [_planned(level, target_bend) for level in LEVELS]
    return StoredSpineSetup.model_validate(
        {
            "surgery_id": SURGERY,
            "revision": 1,
            "created_at": _START,
            "rebaselines": [],
            "setup": {
                "patient_axes": {"kind": "directions", "cephalad": "+x", "left": "+y"},
                "initial": {"kind": "generic"},
                "target": target,
            },
        }
    )


def _planned(level: str, bend: float) -> dict[str, Any]:
    state = vertebra(level, bend)
    angles = [state.coronal_tilt_deg, state.sagittal_tilt_deg, state.axial_rotation_deg]
    return {"vertebra": level, "angles_deg": angles, "position_mm": state.position_mm}
