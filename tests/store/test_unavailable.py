import psycopg
import pytest
from sqlalchemy.exc import DBAPIError, IntegrityError, InternalError, OperationalError, TimeoutError

from store.unavailable import is_unavailable

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
