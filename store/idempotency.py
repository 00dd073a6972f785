"""Answers to requests with an idempotency key, stored in the transaction of what the request changes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import bindparam, delete, insert, select
from sqlalchemy.orm import Session

from spinewatch.errors import SpinewatchError
from store.tables.access import IdempotencyKey

LIFETIME = timedelta(hours=24)
"""Time after which a key may be used for another request."""


class IdempotencyKeyReusedError(SpinewatchError):
    """The key was used for another request."""

    code = "idempotency-key-reused"


@dataclass(frozen=True)
class KeyUse:
    """The use of an idempotency key by a request.

    Attributes
    ----------
    scope
        Whose key it is: the same key of another client is another one.
    key
        The key.
    fingerprint
        Digest of method, path, query and body.
    """

    scope: str
    key: str
    fingerprint: str


@dataclass(frozen=True)
class Answer:
    """What a request was answered with.

    Attributes
    ----------
    status
        Status code.
    headers
        Headers that belong to the answer, such as Location.
    body
        JSON text.
    """

    status: int
    headers: Mapping[str, str]
    body: str


def find(session: Session, use: KeyUse, now: datetime) -> Answer | None:
    """Return the answer that a request with this key had.

    Parameters
    ----------
    session
        Session that writes, so that a request with the same key cannot end meanwhile.
    use
        The key and the request.
    now
        The time.

    Returns
    -------
    Answer or None
        The answer; None when the key is new, or was used longer than ``LIFETIME`` ago.

    Raises
    ------
    IdempotencyKeyReusedError
        The key was used for another request.
    """
    found = session.connection().execute(_FIND, {"scope": use.scope, "key": use.key})
    row = found.one_or_none()
    if row is None or row.expires_at <= now:
        return None
    if row.fingerprint != use.fingerprint:
        raise IdempotencyKeyReusedError(
            "this Idempotency-Key was sent with another request before; use a new key for each new request"
        )
    return Answer(row.status, row.headers, row.body)


def add(session: Session, use: KeyUse, answer: Answer, now: datetime) -> None:
    """Store an answer; keys that are older than ``LIFETIME`` are forgotten.

    Parameters
    ----------
    session
        Session that writes what the request changes.
    use
        The key and the request.
    answer
        The answer.
    now
        The time.
    """
    connection = session.connection()
    connection.execute(_FORGET, {"now": now})
    connection.execute(
        _INSERT,
        {
            "scope": use.scope,
            "key": use.key,
            "fingerprint": use.fingerprint,
            "status": answer.status,
            "headers": dict(answer.headers),
            "body": answer.body,
            "created_at": now,
            "expires_at": now + LIFETIME,
        },
    )


_KEYS = IdempotencyKey.__table__
_FIND = select(_KEYS).where(
    IdempotencyKey.scope == bindparam("scope"), IdempotencyKey.key == bindparam("key")
)
_FORGET = delete(IdempotencyKey).where(IdempotencyKey.expires_at <= bindparam("now"))
_INSERT = insert(IdempotencyKey)
