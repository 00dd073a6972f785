"""Pictures, content-addressed: the same bytes are kept once."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from hashlib import sha256

from sqlalchemy import select
from sqlalchemy.orm import Session

from spinewatch.imaging.header import ImageHeader
from store.tables import Image


@dataclass(frozen=True)
class NewImage:
    """An uploaded picture whose header has been checked."""

    content: bytes
    header: ImageHeader

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the content, hexadecimal."""
        return sha256(self.content).hexdigest()


def keep(session: Session, image: NewImage, now: datetime) -> Image:
    """Return the row of a picture, which is added unless its content is there already."""
    row = session.get(Image, image.sha256)
    if row is None:
        row = Image(
            sha256=image.sha256,
            content=image.content,
            media_type=image.header.media_type,
            width=image.header.width,
            height=image.header.height,
            size_bytes=len(image.content),
            created_at=now,
        )
        session.add(row)
    return row


def content(session: Session, sha256: str) -> bytes:
    """Return the original bytes of a kept picture."""
    return session.scalars(select(Image.content).where(Image.sha256 == sha256)).one()
