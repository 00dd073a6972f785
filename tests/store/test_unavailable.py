import psycopg
import pytest
from sqlalchemy import create_engine, text
from sqlalchemy.exc import (
    DBAPIError,
    IntegrityError,
    InternalError,
    OperationalError,
    ProgrammingError,
    TimeoutError,
)

from store.database import Database
from store.unavailable import disk_is_full, is_unavailable, tables_are_missing

ORIGINAL = Exception("original")


@pytest.mark.parametrize(
    ("error", "unavailable"),
    [
        (OperationalError("", None, ORIGINAL), True),
        (TimeoutError(), True),
        (DBAPIError("", None, ORIGINAL, connection_invalidated=True), True),
        (InternalError("", None, psycopg.errors.IdleInTransactionSessionTimeout()), True),
        (InternalError("", None, ORIGINAL), False),
        (IntegrityError("", None, ORIGINAL), False),
        (ValueError(), False),
    ],
)
def test_only_a_database_that_cannot_be_used_now_is_unavailable(error: Exception, unavailable: bool) -> None:
    assert is_unavailable(error) is unavailable


def test_a_missing_table_does_not_come_back() -> None:
    with pytest.raises(OperationalError) as error:
        create_engine("sqlite://").connect().execute(text("SELECT 1 FROM nothing"))
    assert tables_are_missing(error.value)
    assert not is_unavailable(error.value)
    assert tables_are_missing(ProgrammingError("", None, psycopg.errors.UndefinedTable()))
    assert not tables_are_missing(OperationalError("", None, ORIGINAL))
    assert not tables_are_missing(ValueError())


def fill(database: Database) -> None:
    """Write more than the file has room for."""
    with database.write() as session:
        pages = session.execute(text("PRAGMA page_count")).scalar_one()
        session.execute(text(f"PRAGMA max_page_count={pages}"))
        session.execute(text("CREATE TABLE large AS SELECT randomblob(1000000)"))


def test_a_full_disk_is_told_from_a_busy_database(database: Database) -> None:
    if database.engine.dialect.name == "sqlite":
        with pytest.raises(OperationalError) as error:
            fill(database)
        assert disk_is_full(error.value)
        assert is_unavailable(error.value)
    assert disk_is_full(OperationalError("", None, psycopg.errors.DiskFull()))
    assert not disk_is_full(OperationalError("", None, ORIGINAL))
    assert not disk_is_full(ValueError())
