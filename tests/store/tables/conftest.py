import pytest
from sqlalchemy import select

from store.database import Database
from store.tables.jobs import Job
from tests.store.builders import claimed, new_request, new_stage, new_surgery, succeed


@pytest.fixture
def record(database: Database) -> Database:
    """A record of a measured stage and of a calibration from images."""
    subjects = new_stage(database, new_surgery(database)).id, new_request(database)
    for subject in subjects:
        with database.read() as session:
            job = session.scalars(select(Job.id).where(Job.subject_id == subject)).one()
        assert succeed(database, claimed(database, job))
    return database
