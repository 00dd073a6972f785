"""Table of the events, which are the audit."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import BigInteger, Integer, String
from sqlalchemy.orm import Mapped, mapped_column

from store.tables.base import Base


class Event(Base):
    """One line of the append-only list of events, which is also the audit: what happened, and who did it.

    ``hash`` chains it to the line before (store/events.py); ``actor_key``, ``address`` and ``request_id`` are those of
    an HTTP client.
    """

    __tablename__ = "events"
    __table_args__ = {"sqlite_autoincrement": True}  # noqa: RUF012 - SQLAlchemy's own way; numbers are never used twice

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
