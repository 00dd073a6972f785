"""Whose turn it is."""

from store import jobs, leases
from store.database import Database
from tests.store.builders import CLIENT, LEASE, WORKER, at, new_stage, new_surgery, show


def next_job(database: Database, second: float = 0.0) -> str | None:
    with database.write() as session:
        lease = leases.claim_next(session, at(second), LEASE, 3, WORKER)
    return None if lease is None else lease.job_id


def test_surgeries_take_turns(database: Database) -> None:
    busy, calm = new_surgery(database), new_surgery(database)
    backlog = [new_stage(database, busy, f"S{n:03}", now=at(n)).job.id for n in range(30)]
    assert [next_job(database) for _ in range(2)] == backlog[:2]
    own = [new_stage(database, calm, name, now=at(100)).job.id for name in ("PRE",)]
    assert next_job(database) == own[0]
    assert next_job(database) == backlog[2]


def test_the_surgery_whose_last_job_was_started_longest_ago_is_next(database: Database) -> None:
    surgeries = [new_surgery(database) for _ in range(3)]
    for number in range(3):
        for surgery in surgeries:
            new_stage(database, surgery, f"S{number}")
    order = []
    for second in (0, -3600, 7200, 0, 1, 2, 3, 4, 5):  # whatever the clock says
        job = next_job(database, second)
        assert job is not None
        order.append(show(database, job).surgery_id)
        with database.write() as session:
            jobs.cancel(session, job, at(second), CLIENT)
    assert next_job(database) is None
    assert [set(order[n : n + 3]) for n in (0, 3, 6)] == [set(surgeries)] * 3
    assert order[:3] == order[3:6] == order[6:]


def test_work_outside_surgeries_has_one_turn(database: Database) -> None:
    with database.write() as session:
        outside = [jobs.add(session, "calibration", f"c{n}", at(n)).id for n in range(5)]
    stage = new_stage(database, new_surgery(database), now=at(60)).job.id
    assert {next_job(database), next_job(database)} == {outside[0], stage}
    assert next_job(database) == outside[1]
