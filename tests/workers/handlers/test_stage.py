"""Stages measured on real images."""

from dataclasses import asdict, fields, replace
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import func, select, text

from contract.job import JobState
from contract.revision import AddedCentre, NewRevision, Remeasurement, TriadEdits
from settings import Settings
from spinewatch.calibration.quality.lens_comparison import LensComparisonParameters
from spinewatch.detection.candidates.templates import (
    TemplateError,
    default_template_set,
    write_template_set,
)
from spinewatch.imaging.comparison import ComparisonParameters
from spinewatch.parameters import Parameters
from spinewatch.progress import silent
from spinewatch.tracking.synchronization import SynchronizationParameters
from store import calibrations, jobs, leases, measurements, stage_submission, stage_work
from store.calibration_checks import OLD
from store.clock import utc_now
from store.database import Database
from store.tables.jobs import Job
from store.tables.measurements import FeatureList, Measurement
from store.tables.stages import Stage
from tests.store.builders import CLIENT, RIG, WORKER, new_stage, new_surgery, sample_pair
from workers.handlers.stage import handler
from workers.registry import FilesWantedError, Registry
from workers.worker import Worker


def work_on(database: Database, stage: Stage, settings: Settings | None = None) -> Job:
    settings = settings or Settings()
    Worker(database, settings, Registry([handler(settings)]), WORKER).handle(stage.job.id)
    with database.read() as session:
        return jobs.get(session, stage.job.id)


def submitted(database: Database, pair: tuple[bytes, bytes]) -> Stage:
    return new_stage(database, new_surgery(database), pair=pair, now=utc_now())


def count(database: Database) -> int:
    with database.read() as session:
        return session.scalar(select(func.count()).select_from(Measurement)) or 0


def test_a_stage_is_measured_and_says_with_what(database: Database, tmp_path: Path) -> None:
    file = tmp_path / "templates.npz"
    file.write_bytes(write_template_set(default_template_set()))
    stage = submitted(database, sample_pair())
    job = work_on(database, stage, Settings(templates=file))
    assert (job.state, job.attempts) == (JobState.SUCCEEDED, 1)
    with database.read() as session:
        _, measured = measurements.get(session, stage.surgery_id, "PRE")
        triads = measurements.triads(session, stage.id)
    assert [triad.label for triad in triads] == ["L1", "T11", "T9", "T7"]
    assert measured.result["templates"] == default_template_set().version
    ran = dict(measured.result["parameters"])
    assert ran.pop("calibration_max_age_days") == 1.0
    assert ran.pop("clock_tolerance_seconds") == 300.0
    assert ran.pop("comparison") == asdict(ComparisonParameters())
    assert ran.pop("lenses") == asdict(LensComparisonParameters())
    assert ran.pop("synchronization") == asdict(SynchronizationParameters())
    assert ran.pop("markers") == ["flat-10-14-18"]
    assert set(ran) == {field.name for field in fields(Parameters)}
    assert OLD not in {flag["code"] for flag in measured.result["flags"]}


def test_a_stage_measured_with_an_old_calibration_is_flagged(database: Database) -> None:
    with database.write() as session:
        before = utc_now() - timedelta(days=2)
        calibration = calibrations.add(session, RIG, before, CLIENT, before)
    stage = new_stage(
        database,
        new_surgery(database),
        pair=sample_pair(),
        now=utc_now(),
        calibration=calibration.id,
    )
    work_on(database, stage)
    with database.read() as session:
        _, measured = measurements.get(session, stage.surgery_id, "PRE")
    (flag,) = [flag for flag in measured.result["flags"] if flag["code"] == OLD]
    assert "2.0 days old" in flag["detail"]


def test_a_stage_that_repeats_an_earlier_one_is_flagged_whether_that_is_measured_or_not(
    database: Database,
) -> None:
    surgery, now = new_surgery(database), utc_now()
    first = new_stage(database, surgery, "PRE", sample_pair(), now - timedelta(hours=2), captured_at=now)
    with database.write() as session:  # another worker has it
        leases.claim(session, first.job.id, now, timedelta(seconds=5), 3, WORKER)
    again = new_stage(database, surgery, "POST", sample_pair(), now, captured_at=now - timedelta(hours=1))
    assert work_on(database, again).state is JobState.SUCCEEDED
    with database.read() as session:
        _, measured = measurements.get(session, surgery, "POST")
    flags = {flag["code"]: flag["detail"] for flag in measured.result["flags"]}
    assert "stage PRE again" in flags["frame-repeated"]
    assert "60 minutes before stage PRE" in flags["time-implausible"]


def test_a_later_stage_is_told_from_the_strips_of_an_earlier_one(database: Database) -> None:
    surgery, now = new_surgery(database), utc_now()
    first = new_stage(database, surgery, "PRE", sample_pair(), now - timedelta(hours=1))
    second = new_stage(database, surgery, "POST", sample_pair("POST"), now)
    work_on(database, first)
    with database.read() as session:
        work = stage_work.work(session, second.id, max_compared=4)
    assert set(work.earlier[0].strips) == {"left", "right"}
    made = handler(Settings())
    made.run(work, silent)  # asks for no file
    with pytest.raises(FilesWantedError):
        made.run(replace(work, earlier=(replace(work.earlier[0], strips={}),)), silent)


def test_a_revision_stores_no_strips(database: Database) -> None:
    first = submitted(database, sample_pair())
    work_on(database, first)
    with database.write() as session:
        again = Remeasurement(kind="measure", take=1)
        revised = stage_submission.revise(session, first.surgery_id, "PRE", again, utc_now(), CLIENT)
    work_on(database, revised)
    with database.read() as session:
        rows = session.execute(select(FeatureList.stage_id, FeatureList.strip)).all()
    stored = {stage: [row.strip is not None for row in rows if row.stage_id == stage] for stage, _ in rows}
    assert stored == {first.id: [True, True], revised.id: [False, False]}


def revised(database: Database, stage: Stage, changes: NewRevision) -> Job:
    with database.write() as session:
        take = stage_submission.revise(session, stage.surgery_id, "PRE", changes, utc_now(), CLIENT)
    return work_on(database, take)


def remeasured(database: Database, stage: Stage, take: int = 1, **parameters: Any) -> Job:
    return revised(database, stage, Remeasurement(kind="measure", take=take, parameters=parameters))


def changes_of(database: Database, stage: Stage) -> list[str]:
    with database.read() as session:
        _, measured = measurements.get(session, stage.surgery_id, "PRE")
    return [flag["detail"] for flag in measured.result["flags"] if flag["code"] == "parameters-changed"]


def test_a_result_of_changed_parameters_is_flagged_and_so_are_edits_of_it(database: Database) -> None:
    first = submitted(database, sample_pair())
    work_on(database, first)
    assert changes_of(database, first) == []
    job = remeasured(database, first, rig_check={"max_p_value": 1e-6}, detection={"scales": [1.0, 1.03]})
    assert job.state is JobState.SUCCEEDED
    (detail,) = changes_of(database, first)
    assert ": detection.scales, rig_check.max_p_value (1e-06 instead of 0.001);" in detail
    centre = AddedCentre(action="add", side="left", x=10.0, y=10.0)
    assert revised(database, first, TriadEdits(kind="edit", take=2, centres=[centre])).state == "succeeded"
    assert changes_of(database, first) == [detail]
    assert remeasured(database, first, 3, rig_check={"max_p_value": 0.001}).state is JobState.SUCCEEDED
    assert changes_of(database, first) == []


@pytest.mark.parametrize(
    "parameters",
    [
        {"detection": {"quality": {"n_strips": 0}}},
        {"detection": {"field": {"smoothing": -1}}},
        {"ball_diameter_mm": -1.0},
    ],
)
def test_a_defect_under_changed_parameters_fails_at_once_and_names_them(
    database: Database, parameters: dict[str, Any]
) -> None:
    first = submitted(database, sample_pair())
    work_on(database, first)
    job = remeasured(database, first, **parameters)
    assert (job.state, job.attempts) == (JobState.FAILED, 1)
    assert job.error is not None
    assert job.error["code"] == "invalid-parameter"
    assert next(iter(parameters)) in job.error["detail"]


def test_an_image_that_cannot_be_decoded_fails_at_once_by_name(database: Database) -> None:
    left, right = sample_pair()
    job = work_on(database, submitted(database, (left, right[:20_000])))
    assert (job.state, job.attempts) == (JobState.FAILED, 1)
    assert job.error is not None
    assert job.error["code"] == "invalid-image"
    assert count(database) == 0


def test_the_same_image_in_two_files_fails_by_name(database: Database) -> None:
    left, _ = sample_pair()
    job = work_on(database, submitted(database, (left, left + b"\0")))
    assert job.error is not None
    assert job.error["code"] == "same-image-twice"


def test_a_surgery_of_an_earlier_version_with_names_out_of_order_is_not_measured(database: Database) -> None:
    stage = submitted(database, sample_pair())
    with database.write() as session:
        session.execute(text("""UPDATE surgeries SET vertebrae = '["L1", "T9", "T11", "T7"]'"""))
    job = work_on(database, stage)
    assert (job.state, job.attempts) == (JobState.FAILED, 1)
    assert job.error is not None
    assert job.error["code"] == "invalid-levels"


def test_a_stage_that_breaks_the_library_is_tried_again(database: Database) -> None:
    stage = submitted(database, sample_pair())
    with database.write() as session:
        session.execute(text("UPDATE surgeries SET vertebrae = '[[]]'"))  # not names, as labels must be
    assert work_on(database, stage).state is JobState.QUEUED


def test_a_template_file_that_cannot_be_used_is_named(tmp_path: Path) -> None:
    with pytest.raises(TemplateError, match="SPINEWATCH_TEMPLATES"):
        handler(Settings(templates=tmp_path / "none.npz"))
