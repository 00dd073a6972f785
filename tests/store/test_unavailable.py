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

from store.unavailable import is_unavailable, tables_are_missing

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
