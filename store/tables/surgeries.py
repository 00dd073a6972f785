"""Tables of the surgeries, and of what stays of those that were deleted."""

from __future__ import annotations

from datetime import datetime
from typing import TYPE_CHECKING, Any

from sqlalchemy import JSON, ForeignKey, String, Text, text
from sqlalchemy.orm import Mapped, mapped_column, relationship

from store.tables.base import Base

if TYPE_CHECKING:
    from store.tables.stages import Stage


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
        back_populates="surgery", order_by="Stage.place, Stage.take", lazy="raise"
    )


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
