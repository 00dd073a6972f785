"""Images, content-addressed: the same bytes are stored once."""

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
    """An uploaded image whose header has been checked.

    Attributes
    ----------
    content
        The bytes of the file.
    header
        Its header.
    """

    content: bytes
    header: ImageHeader

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the content, hexadecimal."""
        return sha256(self.content).hexdigest()


def add(session: Session, image: NewImage, now: datetime) -> Image:
    """Return the row of an image, which is added unless its content is stored already.

    Parameters
    ----------
    session
        Session that writes.
    image
        The image.
    now
        Time of the upload.

    Returns
    -------
    Image
        The row.
    """
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
    """Return the original bytes of a stored image.

    Parameters
    ----------
    session
        Session that reads.
    sha256
        SHA-256 of the content, hexadecimal.

    Returns
    -------
    bytes
        The file.
    """
    return session.scalars(select(Image.content).where(Image.sha256 == sha256)).one()
