"""Jobs that compute the spines of a surgery."""

from contract.job import JobState
from store import leases, spine_jobs
from store.database import Database
from store.tables.jobs import Job
from tests.store.builders import LEASE, NOON, WORKER, new_surgery
from tests.store.spines import configured


def submit(database: Database, surgery: str) -> str | None:
    with database.write() as session:
        return spine_jobs.submit(session, surgery, NOON)


def test_without_a_setup_there_is_no_job(database: Database) -> None:
    assert submit(database, new_surgery(database)) is None


def test_one_queued_job_is_enough_and_a_running_one_is_not(database: Database) -> None:
    surgery = configured(database)
    first = submit(database, surgery)
    assert first is not None
    assert submit(database, surgery) is None
    with database.write() as session:
        leases.claim(session, first, NOON, LEASE, 3, WORKER)
    second = submit(database, surgery)
    assert second not in {None, first}
    with database.read() as session:
        row = session.get(Job, second)
    assert row is not None
    assert (row.kind, row.subject_id, row.surgery_id, row.state) == (
        "spine", surgery, surgery, JobState.QUEUED,
    )  # fmt: skip


def test_another_surgery_has_its_own_job(database: Database) -> None:
    assert submit(database, configured(database)) is not None
    assert submit(database, configured(database)) is not None


def test_a_request_returns_the_job_that_is_queued(database: Database) -> None:
    surgery = configured(database)
    first = submit(database, surgery)
    with database.write() as session:
        assert spine_jobs.resubmit(session, surgery, NOON) == first
        leases.claim(session, str(first), NOON, LEASE, 3, WORKER)
        assert spine_jobs.resubmit(session, surgery, NOON) != first


def test_the_latest_state_is_that_of_the_latest_job(database: Database) -> None:
    surgery = configured(database)
    with database.write() as session:
        assert spine_jobs.latest_state(session, surgery) == "not submitted"
        spine_jobs.submit(session, surgery, NOON)
        assert spine_jobs.latest_state(session, surgery) == "queued"
