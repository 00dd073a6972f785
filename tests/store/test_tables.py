"""What the tables promise to queries; that migrations make them is tested in tests/migrations."""

import pytest
from sqlalchemy import text
from sqlalchemy.exc import IntegrityError

from store.database import Database
from store.tables import Base, Triad
from tests.store.builders import claimed, new_stage, new_surgery, succeed


def test_a_triad_has_no_column_per_number() -> None:
    assert [column.name for column in Triad.__table__.columns] == ["stage_id", "position", "label", "triad"]


def test_relationships_load_only_when_asked() -> None:
    lazy = {
        f"{mapper.class_.__name__}.{relationship.key}": relationship.lazy
        for mapper in Base.registry.mappers
        for relationship in mapper.relationships
    }
    assert set(lazy.values()) == {"raise"}


@pytest.mark.parametrize(
    "statement",
    [
        "UPDATE jobs SET progress = 2",
        "UPDATE jobs SET state = 'lost'",
        "UPDATE jobs SET kind = NULL",
        "UPDATE triads SET stage_id = 'none'",
        "UPDATE features SET stage_id = 'none'",
        "DELETE FROM measurements",
        "DELETE FROM stages",
        "INSERT INTO triads SELECT * FROM triads",
    ],
)
def test_the_database_refuses_what_contradicts_it(database: Database, statement: str) -> None:
    succeed(database, claimed(database, new_stage(database, new_surgery(database)).job.id))
    with pytest.raises(IntegrityError), database.write() as session:
        session.execute(text(statement))
