from collections.abc import Iterator
from pathlib import Path

import pytest
from starlette.responses import Response

from contract.flag import Flag
from contract.surgery import NewSurgery
from service.idempotency import JobNotEndedError, Once, Replay
from store import jobs, surgeries
from store.database import Database
from store.idempotency import IdempotencyKeyReusedError, KeyUse
from store.page import PageRequest
from tests.backends import new_database
from tests.store.builders import CLIENT, NOON, new_stage, new_surgery

NEW = NewSurgery(reference="a", vertebrae=["L1"], reference_vertebra="L1")
USE = KeyUse("cart", "key", "f" * 64)
DOCUMENT = Flag(code="a", detail="b")


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    with new_database(tmp_path) as url:
        database = Database(url)
        yield database
        database.close()


def change(database: Database, use: KeyUse | None) -> Response:
    once = Once(database, None if use is None else lambda: use)
    with once.write() as session:
        surgeries.add(session, NEW, NOON, CLIENT)
        return once.answer(DOCUMENT, 201, Location="/v1/x", Retry_After=None)


def count(database: Database) -> int:
    with database.read() as session:
        return surgeries.listed(session, PageRequest()).total


def test_a_request_with_a_key_changes_once(database: Database) -> None:
    first = change(database, USE)
    with pytest.raises(Replay) as again:
        change(database, USE)
    assert count(database) == 1
    assert first.headers["location"] == again.value.answer.headers["Location"] == "/v1/x"
    assert bytes(first.body).decode() == again.value.answer.body == DOCUMENT.model_dump_json()
    assert again.value.answer.status == first.status_code == 201
    assert "retry-after" not in first.headers


def test_a_repeated_request_names_its_job_until_that_has_ended(database: Database) -> None:
    job = new_stage(database, new_surgery(database)).job.id

    def submit() -> Response:
        once = Once(database, lambda: USE)
        with once.write():
            return once.answer(DOCUMENT, 202, Location=f"/v1/jobs/{job}")

    submit()
    with pytest.raises(JobNotEndedError, match="queued") as running:
        submit()
    assert running.value.job_id == job
    with database.write() as session:
        jobs.cancel(session, job, NOON, CLIENT)
    with pytest.raises(Replay) as again:
        submit()
    assert again.value.answer.headers["Location"] == f"/v1/jobs/{job}"


def test_a_request_without_a_key_changes_each_time(database: Database) -> None:
    for _ in range(2):
        assert change(database, None).status_code == 201
    assert count(database) == 2


def test_another_request_with_the_key_changes_nothing(database: Database) -> None:
    change(database, USE)
    with pytest.raises(IdempotencyKeyReusedError):
        change(database, KeyUse("cart", "key", "e" * 64))
    assert count(database) == 1


def test_a_change_that_fails_leaves_the_key_free(database: Database) -> None:
    def fail() -> None:
        once = Once(database, lambda: USE)
        with once.write() as session:
            surgeries.add(session, NEW, NOON, CLIENT)
            once.answer(DOCUMENT, 201)
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert count(database) == 0
    assert change(database, USE).status_code == 201


def test_an_answer_belongs_to_what_is_written(database: Database) -> None:
    with pytest.raises(RuntimeError, match="within the session"):
        Once(database, lambda: USE).answer(DOCUMENT, 201)
