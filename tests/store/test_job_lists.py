from contract.job import JobState
from store import job_lists, retention
from store.database import Database
from store.page import PageRequest
from store.tables.jobs import SPINE_JOB, STAGE_JOB
from tests.store.builders import CLIENT, NOON, at, claimed, new_stage, new_surgery


def test_jobs_are_found_by_state_kind_surgery_and_time(database: Database) -> None:
    surgery, other = new_surgery(database), new_surgery(database)
    early = new_stage(database, surgery, now=at(1)).job.id
    late = new_stage(database, other, now=at(2)).job.id
    claimed(database, late)
    wanted = PageRequest()
    with database.read() as session:

        def found(**filters: object) -> list[str]:
            return [row.id for row in job_lists.listed(session, wanted, **filters).items]  # type: ignore[arg-type]

        assert found() == [late, early]
        assert found(state=JobState.RUNNING) == [late]
        assert found(kind=STAGE_JOB, surgery_id=surgery) == [early]
        assert found(kind=SPINE_JOB) == []
        assert found(created_after=at(2)) == [late]
        assert found(created_before=at(2), created_after=NOON) == [early]
        row = job_lists.listed(session, wanted).items[0]
        assert row.stage is not None
        assert row.stage.name == "PRE"


def test_jobs_of_a_deleted_surgery_are_not_listed(database: Database) -> None:
    kept, deleted = new_surgery(database), new_surgery(database)
    shown = new_stage(database, kept).job.id
    new_stage(database, deleted)
    with database.write() as session:
        retention.delete(session, deleted, None, NOON, CLIENT)
    with database.read() as session:
        assert [row.id for row in job_lists.listed(session, PageRequest()).items] == [shown]
        assert job_lists.listed(session, PageRequest(), surgery_id=deleted).items == []
