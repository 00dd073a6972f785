"""Tables of the radiographs of a surgery, the setups of its spine and the spines of its stages."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING

from sqlalchemy import JSON, BigInteger, Double, ForeignKey, Index, Integer, String, Text
from sqlalchemy.orm import Mapped, mapped_column, relationship

from store.tables.base import Base, Document

if TYPE_CHECKING:
    from store.tables.images import Image


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
