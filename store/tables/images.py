"""Tables of the images."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import BigInteger, ForeignKey, LargeBinary, String
from sqlalchemy.orm import Mapped, mapped_column

from store.tables.base import Base


class Image(Base):
    """An uploaded image file without its metadata, stored once under the SHA-256 of its content."""

    __tablename__ = "images"

    sha256: Mapped[str] = mapped_column(String(64), primary_key=True)
    media_type: Mapped[str] = mapped_column(String(64))
    width: Mapped[int]
    height: Mapped[int]
    size_bytes: Mapped[int] = mapped_column(BigInteger)
    created_at: Mapped[datetime]
    # last: SQLite reads all of a row that stands before a column to get at it
    content: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)


class SentImage(Base):
    """The SHA-256 of a file as it was sent, where the stored one has less: its metadata were removed."""

    __tablename__ = "sent_images"

    sent_sha256: Mapped[str] = mapped_column(String(64), primary_key=True)
    sha256: Mapped[str] = mapped_column(ForeignKey("images.sha256"), index=True)
    created_at: Mapped[datetime]
