import asyncio
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from datetime import timedelta
from pathlib import Path

import pytest
from sqlalchemy import text

from contract.health import HealthCheck
from migrations.history import upgrade
from service.readiness import ReadinessChecks
from settings import Settings
from store import processes
from store.clock import utc_now
from store.database import Database
from store.processes import ProcessKind
from store.queue import JobQueue
from tests.store.builders import new_stage, new_surgery


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(
        database_url=f"sqlite:///{tmp_path / 'x.sqlite'}", min_free_bytes=0, max_upload_bytes=1024
    )


@pytest.fixture
def database(settings: Settings) -> Iterator[Database]:
    upgrade(settings.database_url)
    database = Database(settings.database_url)
    with database.write() as session:
        processes.report(session, "w", ProcessKind.WORKER, "host:1")
    yield database
    database.close()


def checks(database: Database, settings: Settings) -> dict[str, HealthCheck]:
    queue = JobQueue(settings.queue)
    try:
        found = asyncio.run(ReadinessChecks(database, queue, settings).results())
    finally:
        queue.close()
    return {check.name: check for check in found}


def failed(found: dict[str, HealthCheck]) -> set[str]:
    return {check.name for check in found.values() if not check.ok}


def test_all_is_well_with_a_worker(database: Database, settings: Settings) -> None:
    found = checks(database, settings)
    assert failed(found) == set()
    assert list(found) == ["database", "disk", "temporary-files", "queue", "queue-age", "workers"]
    assert found["workers"].figure == 1
    with database.read() as session:
        assert len(processes.alive(session, ProcessKind.SERVER)) == 1


def test_without_a_worker_it_is_not_ready(database: Database, settings: Settings) -> None:
    with database.write() as session:
        processes.forget(session, "w")
    found = checks(database, settings)
    assert failed(found) == {"workers"}
    assert "spinewatch worker" in found["workers"].detail


def test_a_job_that_waits_too_long_is_named(database: Database, settings: Settings) -> None:
    new_stage(
        database, new_surgery(database), now=utc_now() - timedelta(seconds=settings.max_queue_seconds + 60)
    )
    found = checks(database, settings)
    assert failed(found) == {"queue-age"}
    assert (found["queue-age"].figure or 0) > settings.max_queue_seconds


def test_a_disk_that_is_nearly_full_is_named(database: Database, settings: Settings) -> None:
    found = checks(
        database, settings.model_copy(update={"min_free_bytes": 1 << 60, "max_upload_bytes": 1 << 60})
    )
    assert failed(found) == {"disk", "temporary-files"}
    assert (found["disk"].figure or 0) > 0


def test_a_database_that_cannot_be_written_is_named(database: Database, settings: Settings) -> None:
    with database.write() as session:
        session.execute(
            text("CREATE TRIGGER full BEFORE INSERT ON processes BEGIN SELECT RAISE(ABORT, 'full'); END")
        )
    found = checks(database, settings)
    assert failed(found) == {"database"}
    assert "full" in found["database"].detail


def test_a_database_of_another_revision_is_named(database: Database, settings: Settings) -> None:
    with database.write() as session:
        session.execute(text("UPDATE alembic_version SET version_num = '0001'"))
    assert failed(checks(database, settings)) == {"database"}


def test_a_database_that_is_lost_fails_what_depends_on_it(
    database: Database, settings: Settings, tmp_path: Path
) -> None:
    database.close()
    for path in tmp_path.glob("x.sqlite*"):
        path.write_bytes(b"broken" * 500)
    found = checks(database, settings)
    assert failed(found) == {"database", "queue-age", "workers"}
    assert found["workers"].figure is None


def test_a_queue_that_does_not_answer_is_named(
    database: Database, settings: Settings, tmp_path: Path
) -> None:
    queue = JobQueue(settings.queue)
    queue.close()
    with closing(sqlite3.connect(tmp_path / "x-queue.sqlite", isolation_level=None)) as other:
        other.execute("ALTER TABLE task RENAME COLUMN queue TO line")
    try:
        found = asyncio.run(ReadinessChecks(database, queue, settings).results())
    finally:
        queue.close()
    assert failed({check.name: check for check in found}) == {"queue"}
