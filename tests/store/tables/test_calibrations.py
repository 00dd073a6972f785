import pytest

from store.database import Database
from tests.store.tables.refusals import refused


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE calibrations SET rig = '{}'",
        "DELETE FROM calibrations",
        "DELETE FROM calibration_requests",
        "UPDATE calibration_shots SET used = NOT used",
        "DELETE FROM calibration_reports",
    ],
)
def test_the_database_refuses_a_calibration_that_changes(record: Database, statement: str) -> None:
    refused(record, statement)
