"""Tables of the jobs and of the times that their steps take."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING

from sqlalchemy import JSON, BigInteger, CheckConstraint, Double, Index, String
from sqlalchemy.orm import Mapped, mapped_column, relationship

from contract.job import JobState
from store.tables.base import Base, Document

if TYPE_CHECKING:
    from store.tables.stages import Stage

STAGE_JOB = "stage"
"""Kind of the jobs that measure a stage; their subject is a ``Stage``."""

CALIBRATION_JOB = "calibration"
"""Kind of the jobs that calibrate; their subject is a ``CalibrationRequest``."""

SPINE_JOB = "spine"
"""Kind of the jobs that compute the spine of every stage of a surgery; their subject is a ``Surgery``."""


class Job(Base):
    """Work of a ``kind`` for a subject; the row decides which worker may do it, under a lease (store/leases.py).

    ``payload`` is what the handler of the kind needs besides the subject; ``waits_for`` is the job that must end before
    a queued one can be claimed.
    """

    __tablename__ = "jobs"
    __table_args__ = (
        CheckConstraint("progress >= 0 AND progress <= 1", name="progress"),
        Index(None, "state", "enqueued_at"),
        Index(None, "kind", "subject_id"),
        Index(None, "created_at"),
    )

    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    kind: Mapped[str] = mapped_column(String(64))
    subject_id: Mapped[str] = mapped_column(String(36))
    payload: Mapped[Document]
    state: Mapped[JobState]
    progress: Mapped[float] = mapped_column(default=0.0)
    step: Mapped[str | None] = mapped_column(String(64))
    error: Mapped[Document | None] = mapped_column(JSON(none_as_null=True))
    attempts: Mapped[int] = mapped_column(default=0)
    waits_for: Mapped[str | None] = mapped_column(String(36), index=True)
    lease_owner: Mapped[str | None] = mapped_column(String(36))
    lease_until: Mapped[datetime | None]
    enqueued_at: Mapped[datetime]
    created_at: Mapped[datetime]
    started_at: Mapped[datetime | None]
    finished_at: Mapped[datetime | None]

    stage: Mapped[Stage | None] = relationship(
        primaryjoin=f"and_(foreign(Job.subject_id) == Stage.id, Job.kind == '{STAGE_JOB}')",
        viewonly=True,
        lazy="raise",
    )

    @property
    def surgery_id(self) -> str | None:
        """The surgery that the work belongs to, None for work outside a surgery."""
        return self.payload.get("surgery_id")


class StepTime(Base):
    """How often a step of jobs of one kind took a time of a ``bucket`` (store/step_times.py), and their sum, s."""

    __tablename__ = "step_times"

    kind: Mapped[str] = mapped_column(String(64), primary_key=True)
    step: Mapped[str] = mapped_column(String(32), primary_key=True)
    bucket: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    count: Mapped[int] = mapped_column(BigInteger)
    seconds: Mapped[float] = mapped_column(Double)
