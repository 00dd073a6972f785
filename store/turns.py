"""Turns: which jobs can be claimed, and which one is next."""

from __future__ import annotations

from collections.abc import Callable, Collection

from sqlalchemy import ColumnElement, and_, func, or_, select
from sqlalchemy.orm import Session, aliased

from contract.job import FINAL_STATES, JobState
from store.events import Action
from store.tables.events import Event
from store.tables.jobs import Job

_RECENT_EVENTS = 10_000
"""Number of the latest events in which the last start of each surgery's jobs is looked for."""

_other = aliased(Job)
_unended = select(_other.id).where(_other.id == Job.waits_for, _other.state.not_in(tuple(FINAL_STATES)))
CLAIMABLE: ColumnElement[bool] = or_(
    and_(Job.state == JobState.QUEUED, or_(Job.waits_for.is_(None), ~_unended.exists())),
    and_(Job.state == JobState.RUNNING, Job.lease_until.is_(None)),
)
"""Whether a job can be claimed: queued and waiting for no other, or running without a lease."""
_surgery: ColumnElement[str] = Job.payload["surgery_id"].as_string()
_GROUPS = select(_surgery).where(CLAIMABLE).distinct()
_OLDEST = select(Job).where(CLAIMABLE).order_by(Job.created_at, Job.id).limit(1).with_for_update()
_RUNNING = (
    select(_surgery, func.count())
    .where(Job.state == JobState.RUNNING, Job.lease_until.is_not(None))
    .group_by(_surgery)
)


def next_job(session: Session) -> Job | None:
    """Return the job whose turn it is, with its row locked.

    Surgeries take turns: first the one with the fewest running jobs, then the one whose last job was started longest
    ago. Work outside surgeries has one turn too. Within a surgery, jobs are in the order of their creation.

    Parameters
    ----------
    session
        Session that writes.

    Returns
    -------
    Job or None
        The row, None when no job can be claimed.
    """
    groups: list[str | None] = list(session.scalars(_GROUPS))
    if not groups:
        return None
    turn = groups[0] if len(groups) == 1 else min(groups, key=_turns(session, groups))
    return session.scalars(
        _OLDEST.where(_surgery.is_(None) if turn is None else _surgery == turn)
    ).one_or_none()


def _turns(session: Session, groups: Collection[str | None]) -> Callable[[str | None], tuple[int, int, str]]:
    """Return the key by which surgeries are ordered, the one whose turn it is first."""
    running: dict[str | None, int] = {group: count for group, count in session.execute(_RUNNING)}  # noqa: C416 - rows are no pairs
    newest = session.scalar(select(func.max(Event.seq))) or 0
    recent = (Event.action == Action.JOB_STARTED, Event.seq > newest - _RECENT_EVENTS)
    named = Event.surgery_id.in_([group for group in groups if group is not None])
    last = select(Event.surgery_id, func.max(Event.seq)).where(named, *recent).group_by(Event.surgery_id)
    started: dict[str | None, int] = {group: seq for group, seq in session.execute(last)}  # noqa: C416 - as above
    if None in groups:
        outside = select(func.max(Event.seq)).where(Event.surgery_id.is_(None), *recent)
        started[None] = session.scalar(outside) or 0
    return lambda group: (running.get(group, 0), started.get(group, 0), group or "")
