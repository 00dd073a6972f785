"""Tables of the calibrations, of the images that they were made from, and of what is known of them."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING

from sqlalchemy import JSON, ForeignKey, String, Text
from sqlalchemy.orm import Mapped, mapped_column, relationship

from store.tables.base import Base, Document
from store.tables.jobs import CALIBRATION_JOB

if TYPE_CHECKING:
    from store.tables.images import Image
    from store.tables.jobs import Job


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
