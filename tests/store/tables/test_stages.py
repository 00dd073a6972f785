import pytest

from store.database import Database
from tests.store.tables.refusals import refused


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE stages SET surgery_id = 'none'",
        "UPDATE stages SET take = take + 1",
        "DELETE FROM stages",
        "INSERT INTO further_pairs (stage_id, position, left_sha256, right_sha256) VALUES ('none', 1, 'none', 'none')",
    ],
)
def test_the_database_refuses_a_stage_that_changes_or_is_of_nothing(record: Database, statement: str) -> None:
    refused(record, statement)
