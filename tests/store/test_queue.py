import json
import sqlite3
from collections.abc import Iterator
from pathlib import Path

import pytest

from store.queue import JobQueue


@pytest.fixture
def bell(tmp_path: Path) -> Iterator[JobQueue]:
    bell = JobQueue(tmp_path / "bell.sqlite")
    yield bell
    bell.close()


def test_what_was_rung_waits_until_it_is_answered(tmp_path: Path, bell: JobQueue) -> None:
    for job in ("a", "b", "a"):
        bell.ring(job)
    assert bell.waiting() == {"a", "b"}
    answered: list[str] = []
    worker = JobQueue(tmp_path / "bell.sqlite", answered.append)
    while (task := worker.huey.dequeue()) is not None:
        worker.huey.execute(task)
    worker.close()
    assert answered == ["a", "b", "a"]
    assert bell.waiting() == set()


def test_only_the_job_s_id_is_sent_and_as_json(tmp_path: Path, bell: JobQueue) -> None:
    bell.ring("the-job")
    connection = sqlite3.connect(tmp_path / "bell.sqlite")
    ((data,),) = connection.execute("SELECT data FROM task").fetchall()
    connection.close()
    assert json.loads(data).count(["the-job"]) == 1


def test_a_message_that_is_not_json_is_not_run(tmp_path: Path, bell: JobQueue) -> None:
    bell.ring("good")
    connection = sqlite3.connect(tmp_path / "bell.sqlite")
    with connection:
        connection.execute("UPDATE task SET data = ?", (b"\x80\x04K\x01.",))  # a pickle
    connection.close()
    with pytest.raises(ValueError, match="decode"):
        bell.huey.dequeue()
    assert bell.waiting() == set()
