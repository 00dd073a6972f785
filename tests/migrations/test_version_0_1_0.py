"""A database of version 0.1.0 with data, upgraded and taken back."""

from sqlalchemy import select

from contract.calibration import RemovedPoint
from contract.job import JobState
from migrations.history import upgrade
from spinewatch.triads.pose import Pose
from store import calibration_checks, calibrations, jobs, measurements, stages
from store.audit import verify_chain
from store.database import Database
from store.tables.events import Event
from store.tables.jobs import CALIBRATION_JOB, STAGE_JOB
from tests.migrations.databases import contents, move
from tests.migrations.version_0_1_0 import COVARIANCE, RIG_CHECK, ROTATION, TIME, X, Y, Z
from tests.store.builders import new_request, new_surgery

LATER = {
    "api_keys",
    "api_sessions",
    "bursts",
    "pair_results",
    "further_pairs",
    "radiographs",
    "spine_setups",
    "spine_rebaselines",
    "spines",
    "processes",
    "step_times",
    "tombstones",
    "purges",
    "purged_images",
    "sent_images",
    "idempotency_keys",
}
"""Tables that version 0.1.0 has nothing for."""


def test_results_of_version_0_1_0_are_kept_to_the_last_bit(old: Database) -> None:
    upgrade(old.url)
    with old.read() as session:
        _, measured = measurements.get(session, "s", "PRE")
        first, second = measurements.triads(session, "t")
        poses = measurements.poses(session, "t")
        features = measurements.features(session, "t")
        summary = calibration_checks.summary(session, "r")
    assert first.position_mm == [X, Y, Z]
    assert (first.rotation, first.covariance) == (ROTATION, COVARIANCE)
    assert (first.angles_deg, first.error_mm, first.balls["XX"].left) == ([89.0, 91.0, 1.4], 0.25, [5.0, 6.0])
    assert (second.reason, second.label_reason) == ("not determined", "the gaps do not decide")
    assert second.position_mm is None
    assert list(poses) == ["L1"]
    assert isinstance(poses["L1"], Pose)
    assert (features.left[0].x, features.left[0].visible_fraction, features.right) == (1.5, None, [])
    assert measured.result["rig_check"]["p_value"] == RIG_CHECK["chance"]
    assert measured.result["rig_check"]["rotation_deg"] == RIG_CHECK["turn_deg"]
    assert (measured.result["version"], measured.result["templates"]) == ("0.1.0", None)
    assert measured.created_at == TIME
    assert (summary.stages, summary.old) == (1, 1)


def test_jobs_and_events_of_version_0_1_0_are_kept(old: Database) -> None:
    upgrade(old.url)
    with old.read() as session:
        measured, calibrated, failed = (jobs.get(session, job) for job in ("j", "k", "l"))
        events = session.scalars(select(Event).order_by(Event.seq)).all()
    assert (measured.kind, measured.subject_id, measured.surgery_id) == (STAGE_JOB, "t", "s")
    assert (calibrated.kind, calibrated.subject_id, calibrated.payload) == (CALIBRATION_JOB, "r", {})
    assert (failed.state, failed.error) == (JobState.FAILED, {"code": "x", "detail": "y"})
    assert (failed.attempts, failed.enqueued_at, failed.finished_at) == (2, TIME, TIME)
    assert measured.error is None
    assert [(e.seq, e.actor_kind, e.actor_name, e.action, e.surgery_id) for e in events] == [
        (1, "http", "", "surgery:created", "s"),
        (4, "worker", "", "stage:measured", "s"),
        (5, "http", "", "calibration:submitted", None),
    ]
    new_surgery(old)
    with old.read() as session:
        assert session.scalars(select(Event.seq).order_by(Event.seq)).all()[-1] == 6


def test_the_events_of_version_0_1_0_are_chained(old: Database) -> None:
    upgrade(old.url)
    new_surgery(old)
    with old.read() as session:
        chain = verify_chain(session)
    assert (chain.events, chain.last, chain.reason) == (4, 6, None)


def test_reports_of_version_0_1_0_are_shown(old: Database) -> None:
    upgrade(old.url)
    with old.read() as session:
        report = calibrations.report_of(calibrations.get_with_report(session, "r"))
    (removed,) = report.report["removed"]
    assert RemovedPoint.model_validate(removed).residual_px == 2.5


def test_the_way_back_to_version_0_1_0_loses_nothing(old: Database) -> None:
    before = contents(old)
    upgrade(old.url)
    assert set(contents(old)) == set(before) - {"changes"} | {"events"} | LATER
    move(old, "0004")
    assert contents(old) == before


def test_work_goes_on_after_an_upgrade(old: Database) -> None:
    upgrade(old.url)
    request = new_request(old)
    with old.read() as session:
        assert calibrations.get(session, "r").name == "cart"
        stage = stages.get(session, "s", "POST")
    assert stage.job.state is JobState.FAILED
    assert request != "r"


def test_stages_from_before_there_were_events_have_the_order_of_their_times(old: Database) -> None:
    upgrade(old.url)
    with old.read() as session:
        found = [stages.get(session, "s", name) for name in ("PRE", "POST")]
    assert [(stage.number, stage.place) for stage in found] == [(1, 1), (2, 2)]
