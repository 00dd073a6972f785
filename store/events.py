"""Events: what happened in the database, who did it, in order."""

from __future__ import annotations

from datetime import datetime
from enum import StrEnum

from sqlalchemy.orm import Session

from contract.event import Actor
from store.tables import Event


class Action(StrEnum):
    """Actions of this package, as subject:verb; a handler of jobs may add its own."""

    CALIBRATION_CREATED = "calibration:created"
    CALIBRATION_SUBMITTED = "calibration:submitted"
    CALIBRATION_SOLVED = "calibration:solved"
    SURGERY_CREATED = "surgery:created"
    STAGE_SUBMITTED = "stage:submitted"
    STAGE_MEASURED = "stage:measured"
    JOB_STARTED = "job:started"
    JOB_REQUEUED = "job:requeued"
    JOB_FAILED = "job:failed"
    JOB_CANCELLED = "job:cancelled"


def append(
    session: Session, at: datetime, actor: Actor, action: str, subject_id: str, surgery_id: str | None = None
) -> None:
    """Append an event in the transaction of the change itself.

    Parameters
    ----------
    session
        Session that writes.
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
    """
    session.add(
        Event(
            at=at,
            action=str(action),
            actor_kind=actor.kind.value,
            actor_name=actor.name,
            subject_id=subject_id,
            surgery_id=surgery_id,
        )
    )
