import threading

from store import step_times
from store.database import Database


def test_times_are_summed_by_kind_and_step(database: Database) -> None:
    for kind, seconds in (
        ("stage", {"detect": 1.0, "match": 0.5}),
        ("stage", {"detect": 3.0}),
        ("x", {"detect": 9.0}),
    ):
        with database.write() as session:
            step_times.add(session, kind, seconds)
    with database.read() as session:
        rows = [(row.kind, row.step, row.count, row.seconds) for row in step_times.listed(session)]
    assert rows == [("stage", "detect", 2, 4.0), ("stage", "match", 1, 0.5), ("x", "detect", 1, 9.0)]


def test_workers_that_end_jobs_together_lose_no_time(database: Database) -> None:
    def work() -> None:
        for _ in range(10):
            with database.write() as session:
                step_times.add(session, "stage", {"match": 1.0, "detect": 2.0})

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    with database.read() as session:
        assert [(row.count, row.seconds) for row in step_times.listed(session)] == [(40, 80.0), (40, 40.0)]
