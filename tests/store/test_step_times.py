import threading
from math import inf

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
        found = step_times.listed(session)
    rows = [(step.kind, step.step, sum(step.counts), step.seconds) for step in found]
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
        found = [(sum(step.counts), step.seconds) for step in step_times.listed(session)]
    assert found == [(40, 80.0), (40, 40.0)]


def test_times_are_counted_by_their_size(database: Database) -> None:
    times = (0.0, 0.01, 0.010001, 1.0, 60.0, 61.0, 1e6)
    for time in times:
        with database.write() as session:
            step_times.add(session, "stage", {"detect": time})
    with database.read() as session:
        (found,) = step_times.listed(session)
    by_bound = dict(zip((*step_times.BOUNDS_S, inf), found.counts, strict=True))
    assert {bound: count for bound, count in by_bound.items() if count} == {
        0.01: 2,
        0.025: 1,
        1.0: 1,
        60.0: 1,
        inf: 2,
    }


def test_there_are_none_before_the_first_job(database: Database) -> None:
    with database.write() as session:
        step_times.add(session, "stage", {})
    with database.read() as session:
        assert step_times.listed(session) == []
