"""Small rows for tests of the database and the workers."""

from __future__ import annotations

import json
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from typing import Any

from contract.calibration import CalibrationResult
from contract.event import Actor, ActorKind
from contract.job import JobState
from contract.pose import PoseFields
from contract.spine_setup import SpineSetup
from contract.stage import StageResult
from contract.surgery import NewSurgery
from spinewatch.imaging.header import ImageHeader
from spinewatch.rig_files.rig_json import rig_from_dict, rig_to_dict
from store import (
    calibration_requests,
    calibrations,
    job_sweep,
    jobs,
    leases,
    measurements,
    stage_submission,
    surgeries,
)
from store.calibration_requests import NewRequest, NewShot
from store.database import Database
from store.images import NewImage
from store.leases import Lease
from store.measurements import MeasuredStage
from store.stage_submission import NewStage
from store.tables.jobs import CALIBRATION_JOB, Job
from store.tables.stages import Stage
from tests.paths import SAMPLES

SAMPLE = SAMPLES / "D1"
RIG = rig_from_dict(json.loads((SAMPLE / "rig.json").read_text()))
NOON = datetime(2026, 11, 21, 12, tzinfo=UTC)
LEASE = timedelta(seconds=5)
CLIENT = Actor(kind=ActorKind.HTTP, name="127.0.0.1")
WORKER = Actor(kind=ActorKind.WORKER, name="cart:17")


def at(seconds: float) -> datetime:
    return NOON + timedelta(seconds=seconds)


def image(content: bytes) -> NewImage:
    return NewImage(content, ImageHeader("PNG", "image/png", 568, 416))


def sample_pair(stage: str = "PRE") -> tuple[bytes, bytes]:
    return (SAMPLE / stage / "left.png").read_bytes(), (SAMPLE / stage / "right.png").read_bytes()


def new_surgery(database: Database) -> str:
    new = NewSurgery(
        reference="2026-0417", vertebrae=["L1", "T11", "T9", "T7"], reference_vertebra="L1", spine_axis="x"
    )
    with database.write() as session:
        return surgeries.add(session, new, NOON, CLIENT).id


def new_stage(
    database: Database,
    surgery: str,
    name: str = "PRE",
    pair: tuple[bytes, bytes] = (b"left", b"right"),
    now: datetime = NOON,
    calibration: str | None = None,
    captured_at: datetime | None = None,
) -> Stage:
    with database.write() as session:
        return stage_submission.submit(
            session,
            surgeries.get(session, surgery),
            calibrations.get(session, calibration)
            if calibration
            else calibrations.add(session, RIG, now, CLIENT),
            NewStage(name, image(pair[0]), image(pair[1]), captured_at),
            now,
            CLIENT,
        )


def new_request(
    database: Database, shots: int = 2, now: datetime = NOON, captured_at: datetime | None = None
) -> str:
    """Add a request to calibrate whose last shot is held out for verification; return its identifier."""
    new = NewRequest(
        name="cart 1",
        control_field="pegboard-1995",
        control_points=None,
        options={"pixel_size_mm": None, "free": None, "fixed": {}, "estimate_aspect": False},
        shots=[
            NewShot(image(b"left %d" % n), image(b"right %d" % n), used=n < shots - 1) for n in range(shots)
        ],
        captured_at=captured_at,
    )
    with database.write() as session:
        return calibration_requests.submit(session, new, now, CLIENT).id


def show(database: Database, job: str) -> Job:
    with database.read() as session:
        return jobs.get(session, job)


def claim(database: Database, job: str, second: float = 0.0, max_attempts: int = 3) -> Lease | None:
    with database.write() as session:
        return leases.claim(session, job, at(second), LEASE, max_attempts, WORKER)


def claimed(database: Database, job: str, second: float = 0.0) -> Lease:
    lease = claim(database, job, second)
    assert lease is not None
    return lease


def expire(database: Database, job: str) -> None:
    """End the lease of a running job, as the sweep does when its worker is silent."""
    with database.write() as session:
        (seen,) = [row for row in job_sweep.unended(session) if row.id == job]
        assert job_sweep.expire(session, seen)


def succeed(
    database: Database, lease: Lease, second: float = 0.0, result: StageResult | MeasuredStage | None = None
) -> bool:
    """End a job and store its result as a worker does; return whether the lease was held."""
    with database.write() as session:
        held = leases.succeed(session, lease, at(second))
        if held and lease.kind == CALIBRATION_JOB:
            calibrations.add_solved(session, lease.subject_id, solved(), at(second), WORKER)
        elif held:
            measured = (
                result if isinstance(result, MeasuredStage) else MeasuredStage(result or stage_result())
            )
            measurements.add(session, lease.subject_id, measured.packed(), at(second), WORKER)
    return held


def end(database: Database, job: str, state: JobState) -> None:
    lease = claimed(database, job)
    if state == JobState.SUCCEEDED:
        succeed(database, lease)
        return
    with database.write() as session:
        if state == JobState.FAILED:
            leases.fail(session, lease, "invalid-image", "The image is damaged.", NOON, WORKER)
        elif state == JobState.CANCELLED:
            jobs.cancel(session, job, NOON, CLIENT)


def measured_take(database: Database, surgery: str, content: bytes, second: float, **options: bool) -> Stage:
    """Add a take of PRE and measure it."""
    with database.write() as session:
        stage = stage_submission.submit(
            session,
            surgeries.get(session, surgery),
            calibrations.add(session, RIG, NOON, CLIENT),
            NewStage("PRE", image(content + b"l"), image(content + b"r"), None),
            at(second),
            CLIENT,
            **options,
        )
    assert succeed(database, claimed(database, stage.job.id))
    return stage


def spine_setup(**changes: Any) -> SpineSetup:
    """Return a setup with a generic spine."""
    document = {
        "patient_axes": {"kind": "directions", "cephalad": "+x", "left": "+y"},
        "initial": {"kind": "generic"},
    }
    return SpineSetup.model_validate({**document, **changes})


def solved() -> CalibrationResult:
    """Return a small result of a calibration."""
    camera = {"free": ["f"], "sd": {"f": 0.01}, "image_rms_px": 0.05, "points": 30}
    accuracy = {"name": "1", "used": True, "reconstructed": 0, "residuals_mm": {}}
    shot = {
        **accuracy,
        "mean_mm": [None] * 3,
        "sd_mm": [None] * 3,
        "points": {"left": [], "right": []},
        "image_rms_left_px": 0.05,
        "image_rms_right_px": None,
    }
    return CalibrationResult.model_validate(
        {
            "rig": rig_to_dict(RIG),
            "control_field": {"name": "pegboard-1995", "points": 30},
            "cameras": {"left": camera, "right": camera},
            "correlations_above_0.9": [],
            "geometry": {
                "baseline_mm": 421.9,
                "baseline_sd_mm": None,
                "vergence_deg": 32.2,
                "vergence_sd_deg": None,
                "range_mm": [720.0, 720.0],
                "field_of_view_mm": [300.0, 200.0],
                "depth_of_field_mm": [500.0, None],
                "f_number": 4.0,
                "control_depth_mm": 100.0,
            },
            "shots": [shot, {**shot, "used": False}],
            "leave_one_out": None,
            "angles_on_board": [],
            "disparity": None,
            "removed": [],
            "flags": [],
            "version": "0.1.0",
        }
    )


def triad(label: str | None, **changes: Any) -> dict[str, Any]:
    """Return a triad as JSON."""
    identity = [[float(i == j) for j in range(3)] for i in range(3)]
    values = dict(
        zip(
            PoseFields.model_fields,
            (
                None,
                [1.0, 2.0, 3.0],
                [0.1, 0.1, 0.2],
                [0.0, 0.0, 1.0],
                [90.0, 90.0, 0.0],
                identity,
                [1.0, 1.0, 0.5],
                [[float(i == j) * 0.01 for j in range(6)] for i in range(6)],
            ),
            strict=True,
        )
    )
    rest: dict[str, Any] = {
        "label": label,
        "label_reason": None,
        "label_manual": False,
        "model": "triad",
        "error_mm": 0.2,
        "balls": {},
    }
    return {**rest, **values, **changes}


def without_pose(label: str | None, reason: str = "not determined") -> dict[str, Any]:
    """Return a triad without a pose as JSON."""
    return triad(label, **dict.fromkeys(PoseFields.model_fields) | {"reason": reason})


def stage_result(triads: Sequence[dict[str, Any]] | None = None, **changes: Any) -> StageResult:
    """Return a small result of a stage."""
    feature = {"x": 1.5, "y": 2.5, "score": 0.9, "sd_px": [0.1, 0.1]}
    return StageResult.model_validate(
        {
            "features": {"left": [feature, feature], "right": [feature]},
            "fields": {"left": [0, 0, 568, 416], "right": [0, 0, 568, 416]},
            "exposure": {"left": "normal", "right": "normal"},
            "triads": [triad("L1"), triad("T11")] if triads is None else list(triads),
            "flags": [{"code": "a-flag", "detail": "A remark."}],
            "rig_check": None,
            "parameters": {"ball_diameter_mm": 8.0},
            "templates": "1",
            "version": "0.1.0",
            **changes,
        }
    )


RIG_CHECK = {
    "balls": 12,
    "rms_px": 0.25,
    "p_value": 0.5,
    "drifted": False,
    "rotation_deg": [0.0, 0.0, 0.0],
    "rotation_sd_deg": [0.1, 0.1, 0.1],
    "shift_mm": [0.0, 0.0, 0.0],
    "shift_sd_mm": [0.5, 0.5, 0.5],
    "marker_scale": {
        "distances": 12,
        "scale": 0.998,
        "sd": 0.002,
        "common_sd": 0.001,
        "p_value": 0.4,
        "drifted": False,
        "yaw_deg": 0.07,
        "base_mm": 0.8,
    },
}
