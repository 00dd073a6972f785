import pytest

from store import spine_setups
from store.database import Database
from tests.store.builders import CLIENT, NOON, new_surgery, spine_setup
from tests.store.tables.refusals import refused


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE spine_setups SET surgery_id = 'none'",
        "DELETE FROM spine_setups",
        "INSERT INTO spine_setups SELECT * FROM spine_setups",
        "INSERT INTO spine_rebaselines (surgery_id, position, vertebra, before, after, created_at)"
        " VALUES ('none', 0, 'T9', 'PRE', 'POST', '2026-11-28')",
        "INSERT INTO spines (surgery_id, stage_id, setup_revision, fingerprint, version, created_at)"
        " SELECT surgery_id, 'no stage', 1, 'f', '1', created_at FROM spine_setups",
    ],
)
def test_the_database_refuses_a_setup_that_changes_and_a_spine_of_no_stage(
    database: Database, statement: str
) -> None:
    surgery = new_surgery(database)
    with database.write() as session:
        spine_setups.put(session, surgery, spine_setup(), NOON, CLIENT)
    refused(database, statement)
