"""Changes in the order in which they were committed: events of the contents, without those of access and audit."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from sqlalchemy import bindparam, func, or_, select
from sqlalchemy.orm import Session

from contract.change import Change, Changes
from contract.event import Outcome
from contract.job import FINAL_STATES
from store.events import Action
from store.tables.events import Event
from store.tables.jobs import Job
from store.tables.stages import Stage
from store.tables.surgeries import Tombstone

KINDS = ("calibration", "job", "radiograph", "spine", "stage", "surgery")
"""Kinds of what is changed; the actions of other kinds are for administrators only."""


@dataclass(frozen=True)
class Glance:
    """What has happened since the last look at the database.

    Attributes
    ----------
    last
        Number of the last event.
    ended
        Those of the jobs asked for that have ended.
    """

    last: int
    ended: frozenset[str]


def listed(session: Session, since: int, limit: int, surgery_id: str | None = None) -> Changes:
    """Return the changes after a number.

    Parameters
    ----------
    session
        Session that reads. Writers take turns and an event is numbered within its transaction, so that no number
        appears after a larger one.
    since
        Number of the last change that is known; 0 for all.
    limit
        Largest number of changes.
    surgery_id
        Only those of a surgery.

    Returns
    -------
    Changes
        The changes, oldest first; of a surgery that was deleted only its deletion.
    """
    shown = or_(*(Event.action.startswith(f"{kind}:") for kind in KINDS))
    query = select(Event, Stage.name, Stage.take).outerjoin(Stage, Stage.id == Event.subject_id)
    query = query.where(Event.seq > since, shown, Event.outcome != Outcome.REFUSED.value)
    hidden = Event.surgery_id.in_(select(Tombstone.surgery_id))
    query = query.where(
        or_(Event.surgery_id.is_(None), ~hidden, Event.action == Action.SURGERY_DELETED.value)
    )
    if surgery_id is not None:
        query = query.where(Event.surgery_id == surgery_id)
    last = last_number(session)
    rows = session.execute(query.where(Event.seq <= last).order_by(Event.seq).limit(limit + 1)).all()
    changes = [_change(event, name, take) for event, name, take in rows[:limit]]
    done = len(rows) <= limit
    return Changes(changes=changes, last=last if done else changes[-1].seq, done=done)


def last_number(session: Session) -> int:
    """Return the number of the last event.

    Parameters
    ----------
    session
        Session that reads.

    Returns
    -------
    int
        Its number, 0 when there is none.
    """
    return session.scalar(_LAST) or 0


def glance(session: Session, jobs: Collection[str]) -> Glance:
    """Return what those who wait need to know.

    Parameters
    ----------
    session
        Session that reads.
    jobs
        Identifiers of jobs whose end is waited for.

    Returns
    -------
    Glance
        The last number, and the jobs that have ended.
    """
    last = last_number(session)
    if not jobs:
        return Glance(last, frozenset())
    return Glance(last, frozenset(session.scalars(_ENDED, {"jobs": list(jobs)})))


def of_access(session: Session, since: int) -> bool:
    """Return whether anything happened to a key or a session.

    Parameters
    ----------
    session
        Session that reads.
    since
        Number of the last event that is known.

    Returns
    -------
    bool
        Whether a key or a session was made, or is no longer valid, by a later event; not whether one has expired.
    """
    return session.scalar(_OF_ACCESS, {"since": since}) is not None


def _change(event: Event, name: str | None, take: int | None) -> Change:
    return Change(
        seq=event.seq,
        at=event.at,
        kind=event.action.partition(":")[0],
        action=event.action,
        id=event.subject_id,
        surgery_id=event.surgery_id,
        stage=name,
        take=take,
    )


_LAST = select(func.max(Event.seq))
_ENDED = select(Job.id).where(
    Job.id.in_(bindparam("jobs", expanding=True)), Job.state.in_(tuple(FINAL_STATES))
)
_OF_ACCESS = (
    select(Event.seq)
    .where(
        Event.seq > bindparam("since"),
        or_(Event.action.startswith("key:"), Event.action.startswith("session:")),
    )
    .limit(1)
)
