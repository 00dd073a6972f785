import pytest

from contract.key import NewKey, Scope
from store import keys
from store.database import Database
from tests.store.builders import CLIENT, NOON
from tests.store.tables.refusals import refused


@pytest.mark.parametrize(
    "statement",
    [
        "INSERT INTO api_keys SELECT * FROM api_keys",
        "UPDATE api_keys SET key_sha256 = NULL",
        "INSERT INTO api_sessions (token_sha256, key_prefix, created_at, expires_at)"
        " VALUES ('a', 'no key', '2026-11-28', '2026-11-29')",
    ],
)
def test_the_database_refuses_a_key_twice_and_a_session_of_no_key(database: Database, statement: str) -> None:
    with database.write() as session:
        keys.add(session, NewKey(name="cart", scopes=[Scope.ADMIN]), NOON, CLIENT)
    refused(database, statement)
