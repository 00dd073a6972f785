"""API keys in the database: only the SHA-256 of a key is stored, under the prefix that names it."""

from __future__ import annotations

import base64
import hashlib
import hmac
import re
import secrets
from datetime import datetime, timedelta

from sqlalchemy import bindparam, exists, or_, select, update
from sqlalchemy.orm import Session

from contract.event import Actor
from contract.key import NewKey
from store import events
from store.errors import NotFoundError
from store.page import Page, PageRequest, page_of
from store.tables.access import ApiKey

LAST_USE_STEP = timedelta(minutes=1)
"""Uses of a key within this time of the stored one are not stored."""

KEY_FORM = re.compile(r"sw_(?P<prefix>[a-z2-7]{8})_[a-z2-7]{52}", re.ASCII)
"""What every key looks like."""

_SECRET_BYTES = 32
_PREFIX_BYTES = 5
_NOBODY = "0" * 64
_BY_PREFIX = select(*ApiKey.__table__.columns).where(ApiKey.prefix == bindparam("prefix"))


def add(session: Session, new: NewKey, now: datetime, actor: Actor) -> tuple[ApiKey, str]:
    """Make a key.

    Parameters
    ----------
    session
        Session that writes.
    new
        Its name, scopes and time of validity.
    now
        Time of its creation.
    actor
        Who makes it.

    Returns
    -------
    tuple of ApiKey and str
        The new row, and the whole key, which is not stored.
    """
    prefix = _random_text(_PREFIX_BYTES)
    while session.get(ApiKey, prefix) is not None:
        prefix = _random_text(_PREFIX_BYTES)
    key = f"sw_{prefix}_{_random_text(_SECRET_BYTES)}"
    row = ApiKey(
        prefix=prefix,
        key_sha256=digest(key),
        name=new.name,
        scopes=[scope.value for scope in new.scopes],
        created_at=now,
        expires_at=None if new.expires_in_days is None else now + timedelta(days=new.expires_in_days),
        revoked_at=None,
        last_used_at=None,
    )
    session.add(row)
    events.append(session, now, actor, events.Action.KEY_CREATED, prefix)
    return row, key


def authenticate(session: Session, key: str, now: datetime) -> ApiKey | None:
    """Return the row of a key that is valid.

    Parameters
    ----------
    session
        Session that reads.
    key
        The whole key as a client sent it.
    now
        Current time.

    Returns
    -------
    ApiKey or None
        A copy of the row, None when the key is not known, revoked or expired.
    """
    match = KEY_FORM.fullmatch(key)
    if match is None:
        return None
    columns = session.connection().execute(_BY_PREFIX, {"prefix": match["prefix"]}).mappings().one_or_none()
    row = None if columns is None else ApiKey(**columns)
    stored = _NOBODY if row is None else row.key_sha256
    same = hmac.compare_digest(digest(key), stored)
    return row if row is not None and same and is_valid(row, now) else None


def is_valid(row: ApiKey, now: datetime) -> bool:
    """Return whether a key is neither revoked nor expired.

    Parameters
    ----------
    row
        Row of the key.
    now
        Current time.

    Returns
    -------
    bool
        Whether it may be used.
    """
    return row.revoked_at is None and (row.expires_at is None or now < row.expires_at)


def get(session: Session, prefix: str) -> ApiKey:
    """Return a key.

    Parameters
    ----------
    session
        Session that reads.
    prefix
        Visible part of the key.

    Returns
    -------
    ApiKey
        The row.

    Raises
    ------
    NotFoundError
        There is no such key.
    """
    row = session.get(ApiKey, prefix)
    if row is None:
        raise NotFoundError("key")
    return row


def listed(session: Session, wanted: PageRequest) -> Page[ApiKey]:
    """Return a page of all keys, also revoked and expired ones.

    Parameters
    ----------
    session
        Session that reads.
    wanted
        Which part of the list.

    Returns
    -------
    Page of ApiKey
        The rows.
    """
    return page_of(session, select(ApiKey), ApiKey, wanted)


def revoke(session: Session, prefix: str, now: datetime, actor: Actor) -> ApiKey:
    """Refuse a key from now on; one that is revoked already stays as it is.

    Parameters
    ----------
    session
        Session that writes.
    prefix
        Visible part of the key.
    now
        Current time.
    actor
        Who revokes it.

    Returns
    -------
    ApiKey
        The row.

    Raises
    ------
    NotFoundError
        There is no such key.
    """
    row = get(session, prefix)
    if row.revoked_at is None:
        row.revoked_at = now
        events.append(session, now, actor, events.Action.KEY_REVOKED, prefix)
    return row


def any_valid(session: Session, now: datetime) -> bool:
    """Return whether any key can be used.

    Parameters
    ----------
    session
        Session that reads.
    now
        Current time.

    Returns
    -------
    bool
        Whether there is one that is neither revoked nor expired.
    """
    valid = exists().where(
        ApiKey.revoked_at.is_(None), or_(ApiKey.expires_at.is_(None), ApiKey.expires_at > now)
    )
    return bool(session.scalar(select(valid)))


def store_use(session: Session, prefix: str, now: datetime) -> None:
    """Store the time of a use of a key, unless one within ``LAST_USE_STEP`` of it is stored.

    Parameters
    ----------
    session
        Session that writes.
    prefix
        Visible part of the key.
    now
        Time of the use.
    """
    session.execute(
        update(ApiKey)
        .where(
            ApiKey.prefix == prefix,
            or_(ApiKey.last_used_at.is_(None), ApiKey.last_used_at <= now - LAST_USE_STEP),
        )
        .values(last_used_at=now)
    )


def digest(secret: str) -> str:
    """Return the SHA-256 of a key or a token, as it is stored.

    Parameters
    ----------
    secret
        The key or token.

    Returns
    -------
    str
        64 hexadecimal digits.
    """
    return hashlib.sha256(secret.encode()).hexdigest()


def _random_text(size: int) -> str:
    """Return random bytes as lower-case base32, which survives being read aloud and selected with two clicks."""
    return base64.b32encode(secrets.token_bytes(size)).decode().rstrip("=").lower()
