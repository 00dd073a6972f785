import pytest

from store.database import Database
from tests.store.tables.refusals import refused


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE measurements SET result = '{}'",
        "DELETE FROM measurements",
        "UPDATE triads SET stage_id = 'none'",
        "UPDATE features SET stage_id = 'none'",
        "INSERT INTO triads SELECT * FROM triads",
        "INSERT INTO bursts (stage_id, burst) VALUES ('none', '{}')",
    ],
)
def test_the_database_refuses_a_result_that_changes_or_is_of_no_stage(
    record: Database, statement: str
) -> None:
    refused(record, statement)
