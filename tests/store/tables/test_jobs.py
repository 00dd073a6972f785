import pytest

from store.database import Database
from tests.store.tables.refusals import refused


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE jobs SET progress = 2",
        "UPDATE jobs SET state = 'lost'",
        "UPDATE jobs SET kind = NULL",
    ],
)
def test_the_database_refuses_a_job_in_a_state_that_there_is_not(record: Database, statement: str) -> None:
    refused(record, statement)
