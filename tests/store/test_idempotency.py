from datetime import timedelta

import pytest
from sqlalchemy import func, select

from store import idempotency
from store.database import Database
from store.idempotency import LIFETIME, Answer, IdempotencyKeyReusedError, KeyUse
from store.tables.access import IdempotencyKey
from tests.store.builders import NOON

USE = KeyUse("cart", "key 1", "f" * 64)
ANSWER = Answer(201, {"Location": "/v1/surgeries/a"}, '{"id":"a"}')


def add(database: Database, use: KeyUse = USE, after: timedelta = timedelta()) -> None:
    with database.write() as session:
        idempotency.add(session, use, ANSWER, NOON + after)


def find(database: Database, use: KeyUse = USE, after: timedelta = timedelta()) -> Answer | None:
    with database.write() as session:
        return idempotency.find(session, use, NOON + after)


def test_an_answer_is_found_by_its_key(database: Database) -> None:
    assert find(database) is None
    add(database)
    assert find(database) == ANSWER
    assert find(database, KeyUse("cart", "key 2", USE.fingerprint)) is None
    assert find(database, KeyUse("other cart", "key 1", "e" * 64)) is None


def test_a_key_of_another_request_is_refused(database: Database) -> None:
    add(database)
    with pytest.raises(IdempotencyKeyReusedError):
        find(database, KeyUse("cart", "key 1", "e" * 64))


def test_an_answer_is_forgotten_after_its_lifetime(database: Database) -> None:
    add(database)
    assert find(database, after=LIFETIME - timedelta(seconds=1)) == ANSWER
    other = KeyUse("cart", "key 1", "e" * 64)
    assert find(database, other, after=LIFETIME) is None
    add(database, other, after=LIFETIME)
    assert find(database, other, after=LIFETIME) == ANSWER
    with database.read() as session:
        assert session.scalar(select(func.count()).select_from(IdempotencyKey)) == 1


def test_an_answer_is_lost_with_the_change_that_it_belongs_to(database: Database) -> None:
    def fail() -> None:
        with database.write() as session:
            idempotency.add(session, USE, ANSWER, NOON)
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert find(database) is None
