"""Table of the running processes."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import String
from sqlalchemy.orm import Mapped, mapped_column

from store.tables.base import Base


class Process(Base):
    """A running server or worker process; ``last_seen`` is when it reported last, by the clock of the database."""

    __tablename__ = "processes"

    id: Mapped[str] = mapped_column(String(36), primary_key=True)
    kind: Mapped[str] = mapped_column(String(16))
    name: Mapped[str] = mapped_column(String(128))
    started_at: Mapped[datetime]
    last_seen: Mapped[datetime]
