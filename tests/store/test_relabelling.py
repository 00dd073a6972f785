from contract.job import JobState
from contract.revision import Remeasurement
from store import relabelling, stage_submission, stages
from store.database import Database
from store.tables.stages import Stage
from tests.store.builders import (
    CLIENT,
    WORKER,
    at,
    claimed,
    end,
    new_stage,
    new_surgery,
    stage_result,
    succeed,
    triad,
)

ALL = [triad(label) for label in ("L1", "T11", "T9", "T7")]
BY_PRE = {"stage": "PRE", "take": 1, "pair": None}


def submitted(database: Database, surgery: str) -> list[Stage]:
    """Return the latest takes of the stages whose labels are found again after a result is stored."""
    with database.write() as session:
        jobs = relabelling.submit(session, surgery, at(9), WORKER)
    with database.read() as session:
        found = [stages.get(session, surgery, name) for name in ("PRE", "INTER", "POST")]
    return [stage for stage in found if stage.job.id in jobs]


def three_stages(database: Database) -> str:
    """A surgery whose stage INTER was labelled by PRE, and POST by itself."""
    surgery = new_surgery(database)
    for second, (name, labelled_by) in enumerate((("PRE", None), ("INTER", BY_PRE), ("POST", None))):
        stage = new_stage(database, surgery, name, (name.encode(), b"r" + name.encode()), at(second))
        result = stage_result(ALL if labelled_by is None else ALL[:3], labelled_by=labelled_by)
        assert succeed(database, claimed(database, stage.job.id), second, result)
    return surgery


def revise(database: Database, surgery: str, name: str, take: int = 1) -> Stage:
    with database.write() as session:
        changes = Remeasurement(kind="measure", take=take)
        return stage_submission.revise(session, surgery, name, changes, at(5), CLIENT)


def test_nothing_is_asked_for_while_the_same_take_decides(database: Database) -> None:
    assert submitted(database, three_stages(database)) == []


def test_a_stage_is_labelled_again_when_another_take_decides(database: Database) -> None:
    surgery = three_stages(database)
    revision = revise(database, surgery, "PRE")
    assert submitted(database, surgery) == []  # its job has not ended
    assert succeed(database, claimed(database, revision.job.id), 6, stage_result(ALL))
    (again,) = submitted(database, surgery)
    assert (again.name, again.take, again.revised_take) == ("INTER", 2, 1)
    assert (again.changes, again.revised_by) == ({"kind": "relabel", "take": 1}, WORKER.name)
    assert submitted(database, surgery) == []  # it is asked for once


def test_a_job_that_failed_is_not_asked_for_again(database: Database) -> None:
    surgery = three_stages(database)
    revision = revise(database, surgery, "PRE")
    assert succeed(database, claimed(database, revision.job.id), 6, stage_result(ALL))
    (again,) = submitted(database, surgery)
    end(database, again.job.id, JobState.FAILED)
    assert submitted(database, surgery) == []


def test_a_stage_that_none_decides_on_any_more_is_labelled_again(database: Database) -> None:
    surgery = three_stages(database)
    revision = revise(database, surgery, "PRE")
    assert succeed(database, claimed(database, revision.job.id), 6, stage_result(ALL[:2]))
    with database.read() as session:
        assert stages.measured(session, surgery, "PRE").take == 2
    assert submitted(database, surgery) == []  # the first take still has all labels, and decides
