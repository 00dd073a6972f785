import pytest

from store.database import Database
from tests.store.tables.refusals import refused


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE events SET actor_name = 'other'",
        "DELETE FROM events",
        "UPDATE events SET seq = seq + 1",
    ],
)
def test_the_database_refuses_a_line_of_the_audit_that_changes(record: Database, statement: str) -> None:
    refused(record, statement)
