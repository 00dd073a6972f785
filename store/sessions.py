"""Sessions of browsers, made from a key; only the SHA-256 of a session's token is stored."""

from __future__ import annotations

import re
import secrets
from datetime import datetime, timedelta

from sqlalchemy import delete, select
from sqlalchemy.orm import Session, joinedload

from contract.event import Actor
from store import events, keys
from store.tables.access import ApiKey, ApiSession

MAX_SESSIONS = 100
"""Sessions of one key at a time; a further one ends the oldest."""

TOKEN_FORM = re.compile(r"[A-Za-z0-9_-]{43}", re.ASCII)
"""What every token looks like."""

_TOKEN_BYTES = 32


def start(
    session: Session, key: ApiKey, now: datetime, duration: timedelta, actor: Actor
) -> tuple[ApiSession, str]:
    """Start a session of a key, which ends with the key at the latest; remove sessions that have ended.

    Parameters
    ----------
    session
        Session that writes.
    key
        The valid key.
    now
        Current time.
    duration
        Time until the session ends.
    actor
        Who starts it.

    Returns
    -------
    tuple of ApiSession and str
        The new row, and the token for the cookie, which is not stored.
    """
    session.execute(delete(ApiSession).where(ApiSession.expires_at <= now))
    newest = (
        select(ApiSession.token_sha256)
        .where(ApiSession.key_prefix == key.prefix)
        .order_by(ApiSession.created_at.desc(), ApiSession.token_sha256)
        .offset(MAX_SESSIONS - 1)
    )
    for old in session.scalars(newest).all():
        session.execute(delete(ApiSession).where(ApiSession.token_sha256 == old))
    token = secrets.token_urlsafe(_TOKEN_BYTES)
    end = now + duration if key.expires_at is None else min(now + duration, key.expires_at)
    row = ApiSession(token_sha256=keys.digest(token), key_prefix=key.prefix, created_at=now, expires_at=end)
    session.add(row)
    events.append(session, now, actor, events.Action.SESSION_STARTED, key.prefix)
    return row, token


def find(session: Session, token: str, now: datetime) -> ApiSession | None:
    """Return the session of a token.

    Parameters
    ----------
    session
        Session that reads.
    token
        Token from the cookie.
    now
        Current time.

    Returns
    -------
    ApiSession or None
        The row with its key, None when it has ended, is unknown, or its key is no longer valid.
    """
    query = (
        select(ApiSession)
        .where(ApiSession.token_sha256 == keys.digest(token))
        .options(joinedload(ApiSession.key))
    )
    row = session.scalars(query).one_or_none()
    return row if row is not None and now < row.expires_at and keys.is_valid(row.key, now) else None


def end(session: Session, token: str, now: datetime, actor: Actor) -> None:
    """End the session of a token, if there is one.

    Parameters
    ----------
    session
        Session that writes.
    token
        Token from the cookie.
    now
        Current time.
    actor
        Who ends it.
    """
    row = session.get(ApiSession, keys.digest(token))
    if row is not None:
        session.delete(row)
        events.append(session, now, actor, events.Action.SESSION_ENDED, row.key_prefix)
