"""The tables (typed ORM); migrations/ is the only way they are made.

Rows are written once: a repeated upload is a new take, a result is a new row. Only a job's row changes, and
``changes`` tells when. What a calibration is made of, the database itself refuses to change or delete
(migration 0003). Nothing here is particular to one database.
"""

from __future__ import annotations

from datetime import datetime
from enum import StrEnum
from typing import Any

from sqlalchemy import (
    JSON,
    BigInteger,
    CheckConstraint,
    Enum,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    String,
    Text,
    UniqueConstraint,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column, relationship

from store.clock import UtcDateTime

Document = dict[str, Any]

_NAMES = {
    "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    "uq": "uq_%(table_name)s_%(column_0_N_name)s",
    "ck": "ck_%(table_name)s_%(constraint_name)s",
    "fk": "fk_%(table_name)s_%(column_0_N_name)s_%(referred_table_name)s",
    "pk": "pk_%(table_name)s",
}


class JobState(StrEnum):
    """Where a job is; the last three are final."""

    QUEUED = "queued"
    RUNNING = "running"
    SUCCEEDED = "succeeded"
    FAILED = "failed"
    CANCELLED = "cancelled"


FINAL_STATES = frozenset({JobState.SUCCEEDED, JobState.FAILED, JobState.CANCELLED})


class JobKind(StrEnum):
    """What a job makes: the measurement of a stage, or a calibration from pictures of a control field."""

    STAGE = "stage"
    CALIBRATION = "calibration"


class Base(DeclarativeBase):
    """Base of all tables."""

    metadata = MetaData(naming_convention=_NAMES)
    type_annotation_map = {  # noqa: RUF012 - SQLAlchemy's own way of declaring it
        datetime: UtcDateTime,
        Document: JSON,
        list[Any]: JSON,
        JobState: Enum(
            JobState,
            name="state",
            native_enum=False,
            create_constraint=True,
            length=16,
            values_callable=lambda states: [state.value for state in states],
        ),
    }


class Image(Base):
    """An uploaded picture, the original bytes, kept once under the SHA-256 of its content."""

    __tablename__ = "images"

    sha256: Mapped[str] = mapped_column(String(64), primary_key=True)
    content: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)
    media_type: Mapped[str] = mapped_column(String(64))
    width: Mapped[int]
    height: Mapped[int]
    size_bytes: Mapped[int] = mapped_column(BigInteger)
    created_at: Mapped[datetime]


class Calibration(Base):
    """A stereo rig as it was calibrated; ``rig`` is the rig JSON, ``calibrated_at`` null when nobody said when."""

    __tablename__ = "calibrations"

    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    name: Mapped[str] = mapped_column(Text)
    rig: Mapped[Document]
    calibrated_at: Mapped[datetime | None]
    created_at: Mapped[datetime] = mapped_column(index=True)

    report: Mapped[CalibrationReport | None] = relationship(lazy="raise")


class CalibrationRequest(Base):
    """What a calibration is to be made from; its identifier becomes the calibration's.

    ``control_field`` names a built-in control field, or the CSV in ``control_points``; ``options`` are those of
    ``spinewatch calibrate``.
    """

    __tablename__ = "calibration_requests"

    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    name: Mapped[str] = mapped_column(Text)
    control_field: Mapped[str] = mapped_column(Text)
    control_points: Mapped[str | None] = mapped_column(Text)
    options: Mapped[Document]
    captured_at: Mapped[datetime | None]
    created_at: Mapped[datetime]

    shots: Mapped[list[CalibrationShot]] = relationship(lazy="raise", order_by="CalibrationShot.position")
    job: Mapped[Job] = relationship(lazy="raise")


class CalibrationShot(Base):
    """A stereo pair of the control field; ``position`` counts from 0, one that is not ``used`` only verifies."""

    __tablename__ = "calibration_shots"

    request_id: Mapped[str] = mapped_column(ForeignKey("calibration_requests.id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True)
    used: Mapped[bool]
    left_sha256: Mapped[str] = mapped_column(ForeignKey("images.sha256"))
    right_sha256: Mapped[str] = mapped_column(ForeignKey("images.sha256"))

    left: Mapped[Image] = relationship(foreign_keys=[left_sha256], lazy="raise")
    right: Mapped[Image] = relationship(foreign_keys=[right_sha256], lazy="raise")


class CalibrationReport(Base):
    """What is known of a calibration made from pictures, beside its rig (``formats/calibration_json``)."""

    __tablename__ = "calibration_reports"

    calibration_id: Mapped[str] = mapped_column(
        ForeignKey("calibrations.id"), ForeignKey("calibration_requests.id"), primary_key=True
    )
    report: Mapped[Document] = mapped_column(JSON, deferred=True)
    version: Mapped[str] = mapped_column(String(32))

    request: Mapped[CalibrationRequest] = relationship(viewonly=True, lazy="raise")


class Surgery(Base):
    """One operation: the hospital's case number, and the marked vertebrae in order along the spine axis."""

    __tablename__ = "surgeries"

    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    reference: Mapped[str] = mapped_column(Text)
    vertebrae: Mapped[list[Any]]
    reference_vertebra: Mapped[str] = mapped_column(String(16))
    spine_axis: Mapped[str] = mapped_column(String(8))
    created_at: Mapped[datetime] = mapped_column(index=True)

    stages: Mapped[list[Stage]] = relationship(
        back_populates="surgery", order_by="Stage.created_at, Stage.take", lazy="raise"
    )


class Stage(Base):
    """One take of a stage: a stereo pair and the calibration it was taken with."""

    __tablename__ = "stages"
    __table_args__ = (UniqueConstraint("surgery_id", "name", "take"),)

    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    surgery_id: Mapped[str] = mapped_column(ForeignKey("surgeries.id"))
    name: Mapped[str] = mapped_column(String(64))
    take: Mapped[int]
    calibration_id: Mapped[str] = mapped_column(ForeignKey("calibrations.id"))
    left_sha256: Mapped[str] = mapped_column(ForeignKey("images.sha256"))
    right_sha256: Mapped[str] = mapped_column(ForeignKey("images.sha256"))
    captured_at: Mapped[datetime | None]
    created_at: Mapped[datetime]

    surgery: Mapped[Surgery] = relationship(back_populates="stages", lazy="raise")
    calibration: Mapped[Calibration] = relationship(lazy="raise")
    left: Mapped[Image] = relationship(foreign_keys=[left_sha256], lazy="raise")
    right: Mapped[Image] = relationship(foreign_keys=[right_sha256], lazy="raise")
    job: Mapped[Job] = relationship(back_populates="stage", lazy="raise")
    measurement: Mapped[Measurement | None] = relationship(back_populates="stage", lazy="raise")


class Job(Base):
    """The work on a stage or a calibration; the row decides who may do it, under a lease (store/jobs.py)."""

    __tablename__ = "jobs"
    __table_args__ = (
        CheckConstraint("progress >= 0 AND progress <= 1", name="progress"),
        CheckConstraint("(stage_id IS NULL) <> (calibration_request_id IS NULL)", name="subject"),
        Index(None, "state", "rung_at"),
    )

    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    stage_id: Mapped[str | None] = mapped_column(ForeignKey("stages.id"), unique=True)
    calibration_request_id: Mapped[str | None] = mapped_column(
        ForeignKey("calibration_requests.id"), unique=True
    )
    state: Mapped[JobState]
    progress: Mapped[float] = mapped_column(default=0.0)
    step: Mapped[str | None] = mapped_column(String(64))
    error: Mapped[Document | None] = mapped_column(JSON(none_as_null=True))
    attempts: Mapped[int] = mapped_column(default=0)
    lease_owner: Mapped[str | None] = mapped_column(String(36))
    lease_until: Mapped[datetime | None]
    rung_at: Mapped[datetime]
    created_at: Mapped[datetime]
    started_at: Mapped[datetime | None]
    finished_at: Mapped[datetime | None]

    stage: Mapped[Stage | None] = relationship(back_populates="job", lazy="raise")

    @property
    def kind(self) -> JobKind:
        """What the job makes."""
        return JobKind.CALIBRATION if self.stage_id is None else JobKind.STAGE


class Measurement(Base):
    """What was measured in a stage; ``parameters`` and ``version`` say with what, ``flags`` what to doubt.

    ``rig_check`` is what the balls say about the calibration, null when they are too few.
    """

    __tablename__ = "measurements"

    stage_id: Mapped[str] = mapped_column(ForeignKey("stages.id"), primary_key=True)
    flags: Mapped[list[Any]]
    fields: Mapped[Document]
    exposure: Mapped[Document]
    rig_check: Mapped[Document | None] = mapped_column(JSON(none_as_null=True))
    parameters: Mapped[Document]
    version: Mapped[str] = mapped_column(String(32))
    created_at: Mapped[datetime]

    stage: Mapped[Stage] = relationship(back_populates="measurement", lazy="raise")
    features: Mapped[list[FeatureList]] = relationship(lazy="raise", order_by="FeatureList.side")
    triads: Mapped[list[Triad]] = relationship(lazy="raise", order_by="Triad.position")


class FeatureList(Base):
    """The possible ball centres of one view: objects with x, y, score and sd_px, in px, best score first."""

    __tablename__ = "features"

    stage_id: Mapped[str] = mapped_column(ForeignKey("measurements.stage_id"), primary_key=True)
    side: Mapped[str] = mapped_column(String(8), primary_key=True)
    count: Mapped[int]
    points: Mapped[list[Any]] = mapped_column(JSON, deferred=True)


class Triad(Base):
    """A triad in object space, mm and degrees; ``position`` counts a stage's triads from 0.

    Where its balls do not determine a pose, ``reason`` says so and the columns of the pose are null.
    """

    __tablename__ = "triads"

    stage_id: Mapped[str] = mapped_column(ForeignKey("measurements.stage_id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True)
    label: Mapped[str | None] = mapped_column(String(16))
    label_reason: Mapped[str | None] = mapped_column(Text)
    model: Mapped[str] = mapped_column(String(64))
    reason: Mapped[str | None] = mapped_column(Text)
    x_mm: Mapped[float | None]
    y_mm: Mapped[float | None]
    z_mm: Mapped[float | None]
    x_sd_mm: Mapped[float | None]
    y_sd_mm: Mapped[float | None]
    z_sd_mm: Mapped[float | None]
    alpha_deg: Mapped[float | None]
    beta_deg: Mapped[float | None]
    gamma_deg: Mapped[float | None]
    error_mm: Mapped[float]
    normal: Mapped[list[Any] | None] = mapped_column(JSON(none_as_null=True))
    rotation: Mapped[list[Any] | None] = mapped_column(JSON(none_as_null=True))
    rotation_sd_deg: Mapped[list[Any] | None] = mapped_column(JSON(none_as_null=True))
    covariance: Mapped[list[Any] | None] = mapped_column(JSON(none_as_null=True))
    balls: Mapped[Document]


class Change(Base):
    """One line of the append-only feed of changes, which is the audit too."""

    __tablename__ = "changes"
    __table_args__ = {"sqlite_autoincrement": True}  # noqa: RUF012 - as above; numbers are never used twice

    seq: Mapped[int] = mapped_column(BigInteger().with_variant(Integer, "sqlite"), primary_key=True)
    at: Mapped[datetime]
    action: Mapped[str] = mapped_column(String(64))
    surgery_id: Mapped[str | None] = mapped_column(String(36), index=True)
    subject_id: Mapped[str] = mapped_column(String(36))
