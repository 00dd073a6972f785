"""The feed of changes: what happened to the record, by which door, in order."""

from __future__ import annotations

from datetime import datetime
from enum import StrEnum

from sqlalchemy.orm import Session

from store.tables import Change


class Action(StrEnum):
    """What can happen, as source:subject:action."""

    CALIBRATION_CREATED = "http:calibration:created"
    CALIBRATION_SUBMITTED = "http:calibration:submitted"
    CALIBRATION_SOLVED = "worker:calibration:solved"
    SURGERY_CREATED = "http:surgery:created"
    STAGE_SUBMITTED = "http:stage:submitted"
    JOB_CANCELLED = "http:job:cancelled"
    JOB_STARTED = "worker:job:started"
    JOB_REQUEUED = "worker:job:requeued"
    JOB_FAILED = "worker:job:failed"
    STAGE_MEASURED = "worker:stage:measured"


def append(
    session: Session, at: datetime, action: Action, subject_id: str, surgery_id: str | None = None
) -> None:
    """Append one line to the feed, in the transaction of the change itself."""
    session.add(Change(at=at, action=action.value, subject_id=subject_id, surgery_id=surgery_id))
