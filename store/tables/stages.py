"""Tables of the stages and their further pairs."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING

from sqlalchemy import JSON, ForeignKey, Index, String, UniqueConstraint, func, select, text
from sqlalchemy.orm import Mapped, column_property, mapped_column, relationship

from store.tables.base import Base, Document
from store.tables.jobs import STAGE_JOB

if TYPE_CHECKING:
    from store.tables.calibrations import Calibration
    from store.tables.images import Image
    from store.tables.jobs import Job
    from store.tables.measurements import Measurement
    from store.tables.surgeries import Surgery


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


class Stage(Base):
    """One take of a stage: a stereo pair, or the first pair of a burst, and the calibration it was taken with.

    ``number`` counts the submissions to a surgery from 1, whatever the clock says. ``place`` is the number of the first
    take of the name: it gives the order of the stages (`store.stages.IN_ORDER`).

    A revision is a take with the images, the time and the number of an earlier one, ``revised_take``: ``changes``
    (``contract.revision.NewRevision``) are what was asked for at ``revised_at`` by ``revised_by``. For a take with
    images of its own ``changes`` are what was sent of its measurement (``contract.measuring.Measuring``), if anything
    was.
    """

    __tablename__ = "stages"
    __table_args__ = (
        UniqueConstraint("surgery_id", "name", "take"),
        Index(None, "surgery_id", "created_at"),
        Index(None, "calibration_id", "created_at"),
        Index(None, "surgery_id", "place", "take", unique=True),
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
    number: Mapped[int] = mapped_column(server_default=text("0"))
    place: Mapped[int] = mapped_column(server_default=text("0"))

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
    pair_count: Mapped[int] = column_property(
        select(func.count() + 1)
        .select_from(FurtherPair)
        .where(FurtherPair.stage_id == id)
        .correlate_except(FurtherPair)
        .scalar_subquery()
    )
