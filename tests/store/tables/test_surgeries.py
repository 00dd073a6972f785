import pytest

from store.database import Database
from tests.store.tables.refusals import refused


@pytest.mark.parametrize(
    "statement",
    [
        "DELETE FROM surgeries",
        "UPDATE surgeries SET reference = NULL",
    ],
)
def test_the_database_refuses_a_surgery_that_goes_without_a_purge(record: Database, statement: str) -> None:
    refused(record, statement)
