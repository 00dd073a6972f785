"""Events: what happened, who did it, in order, each chained to the one before by its hash.

The hash of an event is the SHA-256 of the hash before it, a line feed, and the event as canonical JSON: all its other
columns with sorted keys, no spaces, ASCII, and the time in UTC with microseconds. Whoever knows one hash can tell
whether any earlier event was changed, left out or put in.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from datetime import UTC, datetime
from enum import StrEnum
from typing import Any

from sqlalchemy import insert, select
from sqlalchemy.orm import Session

from contract.event import Actor, Outcome
from store.tables.events import Event

FIRST_HASH = "0" * 64
"""What the first event is chained to."""

MAX_DETAIL = 256
"""Characters of a detail; the rest is cut off."""

_CHAINED = (
    "seq",
    "at",
    "action",
    "actor_kind",
    "actor_name",
    "actor_key",
    "address",
    "request_id",
    "outcome",
    "detail",
    "surgery_id",
    "subject_id",
)

_LAST = select(Event.seq, Event.hash).order_by(Event.seq.desc()).limit(1)
_INSERT = insert(Event)


class Action(StrEnum):
    """Actions of this package, as subject:verb; a handler of jobs may add its own."""

    CALIBRATION_CREATED = "calibration:created"
    CALIBRATION_SUBMITTED = "calibration:submitted"
    CALIBRATION_SOLVED = "calibration:solved"
    SURGERY_CREATED = "surgery:created"
    SURGERY_DELETED = "surgery:deleted"
    SURGERY_PURGED = "surgery:purged"
    STAGE_SUBMITTED = "stage:submitted"
    STAGE_MEASURED = "stage:measured"
    STAGE_REVISED = "stage:revised"
    RADIOGRAPH_ADDED = "radiograph:added"
    SPINE_CONFIGURED = "spine:configured"
    SPINE_REBASELINED = "spine:rebaselined"
    SPINE_COMPUTED = "spine:computed"
    KEY_CREATED = "key:created"
    KEY_REVOKED = "key:revoked"
    SESSION_STARTED = "session:started"
    SESSION_ENDED = "session:ended"
    REQUEST_REFUSED = "request:refused"
    DATABASE_RESTORED = "database:restored"
    JOB_STARTED = "job:started"
    JOB_REQUEUED = "job:requeued"
    JOB_FAILED = "job:failed"
    JOB_CANCELLED = "job:cancelled"


def append(
    session: Session,
    at: datetime,
    actor: Actor,
    action: str,
    subject_id: str,
    surgery_id: str | None = None,
    *,
    outcome: Outcome = Outcome.SUCCESS,
    detail: str | None = None,
) -> None:
    """Append an event in the transaction of the change itself.

    Parameters
    ----------
    session
        Session that writes (`Database.write`): writers take turns, so that numbers are in the order of commits.
    at
        Time of the event.
    actor
        Who acts.
    action
        What happened, as subject:verb.
    subject_id
        Identifier of what it happened to.
    surgery_id
        The surgery that it belongs to, None for what belongs to none.
    outcome
        Whether it was done.
    detail
        What else is to be known, never about a patient.
    """
    connection = session.connection()
    last = connection.execute(_LAST).one_or_none()
    seq, previous = (0, FIRST_HASH) if last is None else last
    entry = {
        "seq": seq + 1,
        "at": at,
        "action": str(action),
        "actor_kind": actor.kind.value,
        "actor_name": actor.name,
        "actor_key": actor.key,
        "address": actor.address,
        "request_id": actor.request_id,
        "outcome": outcome.value,
        "detail": None if detail is None else detail[:MAX_DETAIL],
        "surgery_id": surgery_id,
        "subject_id": subject_id,
    }
    connection.execute(_INSERT, {**entry, "hash": chained_hash(previous, entry)})


def chained_hash(previous: str, entry: Mapping[str, Any]) -> str:
    """Return the hash of an event.

    Parameters
    ----------
    previous
        Hash of the event before, ``FIRST_HASH`` for the first one.
    entry
        Columns of the event by name; ``at`` is an aware time, or a naive one in UTC.

    Returns
    -------
    str
        64 hexadecimal digits.
    """
    moment: datetime = entry["at"]
    moment = moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment.astimezone(UTC)
    plain = {**{name: entry[name] for name in _CHAINED}, "at": moment.isoformat(timespec="microseconds")}
    canonical = json.dumps(plain, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(f"{previous}\n{canonical}".encode()).hexdigest()
