"""By what clients were let in, and whether that still holds: for connections that last longer than a request."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import select
from sqlalchemy.orm import Session

from store import keys
from store.tables.access import ApiKey, ApiSession


@dataclass(frozen=True)
class Admission:
    """By what a client was let in.

    Attributes
    ----------
    key_prefix
        Visible part of its key.
    session_token
        Token of its session; None when the key itself was sent.
    """

    key_prefix: str
    session_token: str | None


def withdrawn(session: Session, admissions: Collection[Admission], now: datetime) -> frozenset[Admission]:
    """Return the admissions that no longer hold.

    Parameters
    ----------
    session
        Session that reads.
    admissions
        Those of all clients that are connected.
    now
        Current time.

    Returns
    -------
    frozenset of Admission
        Those whose key was revoked or has expired, or whose session has ended.
    """
    if not admissions:
        return frozenset()
    known = select(ApiKey).where(ApiKey.prefix.in_({admission.key_prefix for admission in admissions}))
    valid = {row.prefix for row in session.scalars(known) if keys.is_valid(row, now)}
    digests = {admission: _digest(admission) for admission in admissions}
    sent = [digest for digest in digests.values() if digest is not None]
    open_sessions = select(ApiSession.token_sha256).where(
        ApiSession.token_sha256.in_(sent), ApiSession.expires_at > now
    )
    found = {None, *session.scalars(open_sessions)}
    return frozenset(
        admission
        for admission, digest in digests.items()
        if admission.key_prefix not in valid or digest not in found
    )


def _digest(admission: Admission) -> str | None:
    """Return the SHA-256 under which the session of an admission is stored; None if there is no session."""
    return None if admission.session_token is None else keys.digest(admission.session_token)
