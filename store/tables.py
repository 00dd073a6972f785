"""The tables (typed ORM); only migrations/ creates them.

Rows are written once: a repeated upload is a new take, a result is a new row. Only a job's row changes, and
``events`` has each change. The database itself refuses to change or delete what a calibration is made of
(migration 0003). Nothing here depends on the kind of database. A table has a column where a query needs one; the
rest of a result is a contract model as JSON.
"""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import (
    JSON,
    BigInteger,
    CheckConstraint,
    Double,
    Enum,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    String,
    Text,
    UniqueConstraint,
    func,
    select,
    text,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, column_property, mapped_column, relationship, synonym

from contract.job import JobState
from store.clock import UtcDateTime

Document = dict[str, Any]

_NAMES = {
    "ix": "ix_%(table_name)s_%(column_0_N_name)s",
    "uq": "uq_%(table_name)s_%(column_0_N_name)s",
    "ck": "ck_%(table_name)s_%(constraint_name)s",
    "fk": "fk_%(table_name)s_%(column_0_N_name)s_%(referred_table_name)s",
    "pk": "pk_%(table_name)s",
}


STAGE_JOB = "stage"
"""Kind of the jobs that measure a stage; their subject is a ``Stage``."""

CALIBRATION_JOB = "calibration"
"""Kind of the jobs that calibrate; their subject is a ``CalibrationRequest``."""

SPINE_JOB = "spine"
"""Kind of the jobs that compute the spine of every stage of a surgery; their subject is a ``Surgery``."""


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
    """An uploaded image file without its metadata, stored once under the SHA-256 of its content."""

    __tablename__ = "images"

    sha256: Mapped[str] = mapped_column(String(64), primary_key=True)
    content: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)
    media_type: Mapped[str] = mapped_column(String(64))
    width: Mapped[int]
    height: Mapped[int]
    size_bytes: Mapped[int] = mapped_column(BigInteger)
    created_at: Mapped[datetime]


class Calibration(Base):
    """A stereo rig as it was calibrated; ``rig`` is the rig JSON, ``calibrated_at`` null when unknown."""

    __tablename__ = "calibrations"

    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    name: Mapped[str] = mapped_column(Text)
    rig: Mapped[Document]
    calibrated_at: Mapped[datetime | None]
    created_at: Mapped[datetime] = mapped_column(index=True)

    report: Mapped[CalibrationReport | None] = relationship(lazy="raise")


class CalibrationRequest(Base):
    """The input of a calibration; its identifier becomes the calibration's.

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
    job: Mapped[Job] = relationship(
        primaryjoin=f"and_(foreign(Job.subject_id) == CalibrationRequest.id, Job.kind == '{CALIBRATION_JOB}')",
        viewonly=True,
        lazy="raise",
    )


class CalibrationShot(Base):
    """A stereo pair of the control field; ``position`` counts from 0, not ``used`` means held out for verification."""

    __tablename__ = "calibration_shots"

    request_id: Mapped[str] = mapped_column(ForeignKey("calibration_requests.id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True)
    used: Mapped[bool]
    left_sha256: Mapped[str] = mapped_column(ForeignKey("images.sha256"))
    right_sha256: Mapped[str] = mapped_column(ForeignKey("images.sha256"))

    left: Mapped[Image] = relationship(foreign_keys=[left_sha256], lazy="raise")
    right: Mapped[Image] = relationship(foreign_keys=[right_sha256], lazy="raise")


class CalibrationReport(Base):
    """What is known of a calibration made from images besides its rig (``contract.calibration.CalibrationQuality``)."""

    __tablename__ = "calibration_reports"

    calibration_id: Mapped[str] = mapped_column(
        ForeignKey("calibrations.id"), ForeignKey("calibration_requests.id"), primary_key=True
    )
    report: Mapped[Document] = mapped_column(JSON, deferred=True)
    version: Mapped[str] = mapped_column(String(32))

    request: Mapped[CalibrationRequest] = relationship(viewonly=True, lazy="raise")


class Surgery(Base):
    """One operation: the case number, the marked vertebrae in order along the spine axis, and unusual levels."""

    __tablename__ = "surgeries"

    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    reference: Mapped[str] = mapped_column(Text)
    vertebrae: Mapped[list[Any]]
    reference_vertebra: Mapped[str] = mapped_column(String(16))
    spine_axis: Mapped[str] = mapped_column(String(8))
    extra_levels: Mapped[list[Any]] = mapped_column(JSON, server_default=text("'[]'"))
    created_at: Mapped[datetime] = mapped_column(index=True)

    stages: Mapped[list[Stage]] = relationship(
        back_populates="surgery", order_by="Stage.created_at, Stage.take", lazy="raise"
    )


class Stage(Base):
    """One take of a stage: a stereo pair, or the first pair of a burst, and the calibration it was taken with.

    A revision is a take with the images and the time of an earlier one, ``revised_take``: ``changes``
    (``contract.revision.NewRevision``) are what was asked for at ``revised_at`` by ``revised_by``.
    """

    __tablename__ = "stages"
    __table_args__ = (
        UniqueConstraint("surgery_id", "name", "take"),
        Index(None, "surgery_id", "created_at"),
        Index(None, "calibration_id", "created_at"),
    )

    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    surgery_id: Mapped[str] = mapped_column(ForeignKey("surgeries.id"))
    name: Mapped[str] = mapped_column(String(64))
    take: Mapped[int]
    calibration_id: Mapped[str] = mapped_column(ForeignKey("calibrations.id"))
    left_sha256: Mapped[str] = mapped_column(ForeignKey("images.sha256"))
    right_sha256: Mapped[str] = mapped_column(ForeignKey("images.sha256"))
    captured_at: Mapped[datetime | None]
    left_exposed_at: Mapped[datetime | None]
    right_exposed_at: Mapped[datetime | None]
    created_at: Mapped[datetime]
    revised_take: Mapped[int | None]
    changes: Mapped[Document | None] = mapped_column(JSON(none_as_null=True))
    revised_at: Mapped[datetime | None]
    revised_by: Mapped[str | None] = mapped_column(String(128))

    surgery: Mapped[Surgery] = relationship(back_populates="stages", lazy="raise")
    calibration: Mapped[Calibration] = relationship(lazy="raise")
    left: Mapped[Image] = relationship(foreign_keys=[left_sha256], lazy="raise")
    right: Mapped[Image] = relationship(foreign_keys=[right_sha256], lazy="raise")
    job: Mapped[Job] = relationship(
        primaryjoin=f"and_(foreign(Job.subject_id) == Stage.id, Job.kind == '{STAGE_JOB}')",
        viewonly=True,
        lazy="raise",
    )
    measurement: Mapped[Measurement | None] = relationship(back_populates="stage", lazy="raise")
    further_pairs: Mapped[list[FurtherPair]] = relationship(
        lazy="raise", order_by="FurtherPair.position", cascade="save-update, merge"
    )


class FurtherPair(Base):
    """A pair of a burst after the first one, which the stage has; ``position`` counts from 1."""

    __tablename__ = "further_pairs"

    stage_id: Mapped[str] = mapped_column(ForeignKey("stages.id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True)
    left_sha256: Mapped[str] = mapped_column(ForeignKey("images.sha256"))
    right_sha256: Mapped[str] = mapped_column(ForeignKey("images.sha256"))
    left_exposed_at: Mapped[datetime | None]
    right_exposed_at: Mapped[datetime | None]

    left: Mapped[Image] = relationship(foreign_keys=[left_sha256], lazy="raise")
    right: Mapped[Image] = relationship(foreign_keys=[right_sha256], lazy="raise")


class Job(Base):
    """Work of a ``kind`` for a subject; the row decides which worker may do it, under a lease (store/jobs.py).

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


class Triad(Base):
    """A triad of a measured stage (``contract.triad.Triad``); ``position`` counts a stage's triads from 0."""

    __tablename__ = "triads"

    stage_id: Mapped[str] = mapped_column(ForeignKey("measurements.stage_id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True)
    label: Mapped[str | None] = mapped_column(String(16))
    triad: Mapped[Document]


class Measurement(Base):
    """The result of a stage: ``contract.stage.StageResult`` without features and triads, which have tables."""

    __tablename__ = "measurements"

    stage_id: Mapped[str] = mapped_column(ForeignKey("stages.id"), primary_key=True)
    result: Mapped[Document]
    created_at: Mapped[datetime]

    stage: Mapped[Stage] = relationship(back_populates="measurement", lazy="raise")
    features: Mapped[list[FeatureList]] = relationship(lazy="raise", order_by="FeatureList.side")
    burst: Mapped[Burst | None] = relationship(lazy="raise")
    triad_count: Mapped[int] = column_property(
        select(func.count())
        .select_from(Triad)
        .where(Triad.stage_id == stage_id)
        .correlate_except(Triad)
        .scalar_subquery()
    )


class Burst(Base):
    """The burst of a stage (``contract.burst.Burst``); a stage of a single pair has none."""

    __tablename__ = "bursts"

    stage_id: Mapped[str] = mapped_column(ForeignKey("measurements.stage_id"), primary_key=True)
    burst: Mapped[Document]


class FeatureList(Base):
    """The features of one image (``contract.features.Feature``), best score first."""

    __tablename__ = "features"

    stage_id: Mapped[str] = mapped_column(ForeignKey("measurements.stage_id"), primary_key=True)
    side: Mapped[str] = mapped_column(String(8), primary_key=True)
    count: Mapped[int]
    points: Mapped[list[Any]] = mapped_column(JSON, deferred=True)


class PairResult(Base):
    """What a pair of a stage was measured from (``contract.pair_result.PairResult``), as compressed JSON."""

    __tablename__ = "pair_results"

    stage_id: Mapped[str] = mapped_column(ForeignKey("measurements.stage_id"), primary_key=True)
    pair: Mapped[int] = mapped_column(primary_key=True)
    content: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)


class Radiograph(Base):
    """A radiograph of a surgery (``contract.radiograph.Radiograph``), without the metadata of its file."""

    __tablename__ = "radiographs"

    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    surgery_id: Mapped[str] = mapped_column(ForeignKey("surgeries.id"), index=True)
    view: Mapped[str] = mapped_column(String(8))
    positive_on: Mapped[str] = mapped_column(String(8))
    row_spacing_mm: Mapped[float] = mapped_column(Double)
    column_spacing_mm: Mapped[float] = mapped_column(Double)
    spacing_source: Mapped[str] = mapped_column(String(32))
    image_sha256: Mapped[str] = mapped_column(ForeignKey("images.sha256"))
    created_at: Mapped[datetime]

    image: Mapped[Image] = relationship(lazy="raise")


class SpineSetup(Base):
    """A revision of the setup of a surgery's spine (``contract.spine_setup.SpineSetup``); the largest number counts."""

    __tablename__ = "spine_setups"

    surgery_id: Mapped[str] = mapped_column(ForeignKey("surgeries.id"), primary_key=True)
    revision: Mapped[int] = mapped_column(primary_key=True)
    document: Mapped[Document]
    created_at: Mapped[datetime]


class SpineRebaseline(Base):
    """A marker that was clamped again between two stages; ``position`` counts those of a surgery from 0."""

    __tablename__ = "spine_rebaselines"

    surgery_id: Mapped[str] = mapped_column(ForeignKey("surgeries.id"), primary_key=True)
    position: Mapped[int] = mapped_column(primary_key=True)
    vertebra: Mapped[str] = mapped_column(String(16))
    before: Mapped[str] = mapped_column(String(64))
    after: Mapped[str] = mapped_column(String(64))
    created_at: Mapped[datetime]


class Spine(Base):
    """The spine of a stage (``contract.spine.StageSpine``), or the reason why there is none; the last row counts.

    ``fingerprint`` is that of the inputs (store/spines.py): a row whose inputs have changed is out of date.
    """

    __tablename__ = "spines"
    __table_args__ = (Index(None, "surgery_id", "stage_id"), {"sqlite_autoincrement": True})

    id: Mapped[int] = mapped_column(BigInteger().with_variant(Integer, "sqlite"), primary_key=True)
    surgery_id: Mapped[str] = mapped_column(ForeignKey("surgeries.id"))
    stage_id: Mapped[str] = mapped_column(ForeignKey("measurements.stage_id"))
    setup_revision: Mapped[int]
    fingerprint: Mapped[str] = mapped_column(String(64))
    document: Mapped[Document | None] = mapped_column(JSON(none_as_null=True), deferred=True)
    reason: Mapped[str | None] = mapped_column(Text)
    version: Mapped[str] = mapped_column(String(32))
    created_at: Mapped[datetime]


class ApiKey(Base):
    """A key of the HTTP API (``contract.key.Key``); of the key itself only the SHA-256 is stored."""

    __tablename__ = "api_keys"

    prefix: Mapped[str] = mapped_column(String(16), primary_key=True)
    id: Mapped[str] = synonym("prefix")
    key_sha256: Mapped[str] = mapped_column(String(64))
    name: Mapped[str] = mapped_column(String(64))
    scopes: Mapped[list[Any]]
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime | None]
    revoked_at: Mapped[datetime | None]
    last_used_at: Mapped[datetime | None]


class ApiSession(Base):
    """A session of a browser, made from a key; of the token in its cookie only the SHA-256 is stored."""

    __tablename__ = "api_sessions"

    token_sha256: Mapped[str] = mapped_column(String(64), primary_key=True)
    key_prefix: Mapped[str] = mapped_column(ForeignKey("api_keys.prefix"), index=True)
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime]

    key: Mapped[ApiKey] = relationship(lazy="raise")


class IdempotencyKey(Base):
    """The answer to a request with an ``Idempotency-Key``; ``scope`` is whose key it is."""

    __tablename__ = "idempotency_keys"

    scope: Mapped[str] = mapped_column(String(128), primary_key=True)
    key: Mapped[str] = mapped_column(String(255), primary_key=True)
    fingerprint: Mapped[str] = mapped_column(String(64))
    status: Mapped[int]
    headers: Mapped[Document]
    body: Mapped[str] = mapped_column(Text)
    created_at: Mapped[datetime]
    expires_at: Mapped[datetime] = mapped_column(index=True)


class Process(Base):
    """A running server or worker process; ``last_seen`` is when it reported last, by the clock of the database."""

    __tablename__ = "processes"

    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    kind: Mapped[str] = mapped_column(String(16))
    name: Mapped[str] = mapped_column(String(128))
    started_at: Mapped[datetime]
    last_seen: Mapped[datetime]


class StepTime(Base):
    """How often a step of jobs of one kind took a time of a ``bucket`` (store/step_times.py), and their sum, s."""

    __tablename__ = "step_times"

    kind: Mapped[str] = mapped_column(String(64), primary_key=True)
    step: Mapped[str] = mapped_column(String(32), primary_key=True)
    bucket: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    count: Mapped[int] = mapped_column(BigInteger)
    seconds: Mapped[float] = mapped_column(Double)


class Event(Base):
    """One line of the append-only list of events, which is also the audit: what happened, and who did it.

    ``hash`` chains it to the line before (store/events.py); ``actor_key``, ``address`` and ``request_id`` are those of
    an HTTP client.
    """

    __tablename__ = "events"
    __table_args__ = {"sqlite_autoincrement": True}  # noqa: RUF012 - as above; numbers are never used twice

    seq: Mapped[int] = mapped_column(BigInteger().with_variant(Integer, "sqlite"), primary_key=True)
    at: Mapped[datetime]
    action: Mapped[str] = mapped_column(String(64))
    actor_kind: Mapped[str] = mapped_column(String(16))
    actor_name: Mapped[str] = mapped_column(String(128))
    surgery_id: Mapped[str | None] = mapped_column(String(36), index=True)
    subject_id: Mapped[str] = mapped_column(String(36))
    actor_key: Mapped[str | None] = mapped_column(String(16))
    address: Mapped[str | None] = mapped_column(String(64))
    request_id: Mapped[str | None] = mapped_column(String(64))
    outcome: Mapped[str] = mapped_column(String(16))
    detail: Mapped[str | None] = mapped_column(String(256))
    hash: Mapped[str] = mapped_column(String(64))


class Tombstone(Base):
    """A surgery that was deleted: it is hidden, and gone once ``purges`` has it too."""

    __tablename__ = "tombstones"

    surgery_id: Mapped[str] = mapped_column(String(36), primary_key=True)
    deleted_at: Mapped[datetime]
    actor_kind: Mapped[str] = mapped_column(String(16))
    actor_name: Mapped[str] = mapped_column(String(128))
    reason: Mapped[str | None] = mapped_column(Text)


class Purge(Base):
    """A surgery whose rows were removed; ``export_sha256`` is that of the file which has them, null without one."""

    __tablename__ = "purges"

    surgery_id: Mapped[str] = mapped_column(ForeignKey("tombstones.surgery_id"), primary_key=True)
    purged_at: Mapped[datetime]
    actor_kind: Mapped[str] = mapped_column(String(16))
    actor_name: Mapped[str] = mapped_column(String(128))
    reason: Mapped[str] = mapped_column(Text)
    export_sha256: Mapped[str | None] = mapped_column(String(64))


class PurgedImage(Base):
    """An image that was removed with a surgery, because nothing else used it."""

    __tablename__ = "purged_images"

    sha256: Mapped[str] = mapped_column(String(64), primary_key=True)
    surgery_id: Mapped[str] = mapped_column(ForeignKey("purges.surgery_id"), primary_key=True)


class SentImage(Base):
    """The SHA-256 of a file as it was sent, where the stored one has less: its metadata were removed."""

    __tablename__ = "sent_images"

    sent_sha256: Mapped[str] = mapped_column(String(64), primary_key=True)
    sha256: Mapped[str] = mapped_column(ForeignKey("images.sha256"), index=True)
    created_at: Mapped[datetime]
