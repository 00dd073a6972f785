"""Images, content-addressed: the same bytes are stored once."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property

from sqlalchemy import bindparam, select
from sqlalchemy.orm import Session

from spinewatch.imaging.header import ImageHeader
from store.errors import ImageDamagedError
from store.tables.images import Image, SentImage


@dataclass(frozen=True)
class NewImage:
    """An uploaded image whose header has been checked.

    Attributes
    ----------
    content
        The bytes that are stored.
    header
        Its header.
    sent_sha256
        SHA-256 of the file as it was sent, hexadecimal, where that had metadata too; None if nothing was removed.
    """

    content: bytes
    header: ImageHeader
    sent_sha256: str | None = None

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the content, hexadecimal."""
        return digest(self.content)


@dataclass(frozen=True)
class StoredImage:
    """What is stored of an image besides its content.

    Attributes
    ----------
    sha256
        SHA-256 of the content, hexadecimal.
    media_type
        Media type of the file.
    width, height
        Size, px.
    size_bytes
        Size of the file, bytes.
    """

    sha256: str
    media_type: str
    width: int
    height: int
    size_bytes: int


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
    return add_all(session, [image], now)[0]


def add_all(session: Session, new: Sequence[NewImage], now: datetime) -> list[Image]:
    """Return the rows of images, which are added unless their content is stored already.

    Parameters
    ----------
    session
        Session that writes.
    new
        The images.
    now
        Time of the upload.

    Returns
    -------
    list of Image
        The rows in the same order.
    """
    known = session.scalars(_KNOWN, {"sha256": [image.sha256 for image in new]})
    rows = {row.sha256: row for row in known}
    for image in new:
        if image.sha256 not in rows:
            rows[image.sha256] = _row(image, now)
            session.add(rows[image.sha256])
        if image.sent_sha256 is not None and session.get(SentImage, image.sent_sha256) is None:
            session.add(SentImage(sent_sha256=image.sent_sha256, sha256=image.sha256, created_at=now))
    return [rows[image.sha256] for image in new]


def _row(image: NewImage, now: datetime) -> Image:
    return Image(
        sha256=image.sha256,
        content=image.content,
        media_type=image.header.media_type,
        width=image.header.width,
        height=image.header.height,
        size_bytes=len(image.content),
        created_at=now,
    )


def content(session: Session, sha256: str) -> bytes:
    """Return the bytes of a stored image, which are checked against their SHA-256.

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

    Raises
    ------
    ImageDamagedError
        The stored bytes are not those that were stored first.
    """
    stored = session.scalars(select(Image.content).where(Image.sha256 == sha256)).one()
    if digest(stored) != sha256:
        raise ImageDamagedError(
            f"the stored image {sha256[:12]} is damaged: it differs from its SHA-256; restore a backup from before, and"
            " check the disk"
        )
    return stored


def digest(content: bytes) -> str:
    """Return the SHA-256 of a file.

    Parameters
    ----------
    content
        The bytes.

    Returns
    -------
    str
        64 hexadecimal digits.
    """
    return hashlib.sha256(content).hexdigest()


_KNOWN = select(Image).where(Image.sha256.in_(bindparam("sha256", expanding=True)))
