"""Calibrations from real images."""

import pytest
from sqlalchemy import select

from contract.calibration import CalibrationQuality, ShotQuality
from contract.job import JobState
from settings import Settings
from spinewatch.camera import Rig
from spinewatch.errors import RigError
from store import calibration_requests, calibrations, jobs
from store.calibration_requests import NewRequest, NewShot
from store.clock import utc_now
from store.database import Database
from store.tables.jobs import Job
from tests.paths import SAMPLES
from tests.store.builders import CLIENT, WORKER, image, new_request
from workers.handlers.calibration import handler
from workers.registry import Registry
from workers.worker import Worker

BOARD = SAMPLES / "calibration" / "C1" / "C"


def work_on(database: Database, request: str) -> Job:
    with database.read() as session:
        job = session.scalars(select(Job.id).where(Job.subject_id == request)).one()
    Worker(database, Settings(), Registry([handler(Settings())]), WORKER).handle(job)
    with database.read() as session:
        return jobs.get(session, job)


def submitted(database: Database) -> str:
    """Submit one shot of the pegboard; return its identifier."""
    left, right = (image((BOARD / f"{side}.png").read_bytes()) for side in ("left", "right"))
    new = NewRequest(
        name="cart 1",
        control_field="pegboard-1995",
        control_points=None,
        options={"pixel_size_mm": None, "free": ["f"], "fixed": {}, "estimate_aspect": False},
        shots=[NewShot(left, right, used=True)],
        captured_at=None,
    )
    with database.write() as session:
        return calibration_requests.submit(session, new, utc_now(), CLIENT).id


def test_a_request_is_calibrated(database: Database) -> None:
    request = submitted(database)
    assert work_on(database, request).state is JobState.SUCCEEDED
    with database.read() as session:
        row = calibrations.get_with_report(session, request)
    assert row.rig["name"] == "cart 1"
    quality = CalibrationQuality[ShotQuality].model_validate(calibrations.report_of(row).report)
    assert quality.geometry.baseline_mm == pytest.approx(421.9, abs=2)
    assert "f" in quality.cameras.left.free
    assert "K1" not in quality.cameras.left.free


def test_images_that_determine_no_calibration_fail_by_name(database: Database) -> None:
    job = work_on(database, new_request(database))
    assert job.state is JobState.FAILED
    assert job.error is not None
    assert job.error["code"] == "invalid-image"


def test_a_rig_that_no_stage_would_take_is_not_stored(
    database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(rig: Rig) -> None:
        raise RigError("right.rotation_deg", f"of {rig.name} is implausible")

    monkeypatch.setattr("workers.handlers.calibration.check_plausible_rig", refuse)
    request = submitted(database)
    job = work_on(database, request)
    assert job.state is JobState.FAILED
    assert job.error is not None
    assert job.error["code"] == "invalid-rig"
    assert job.attempts == 1
