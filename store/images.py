"""Images, content-addressed: the same bytes are stored once."""

from __future__ import annotations

import hashlib
import sqlite3
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from typing import TypeVar

from sqlalchemy import ColumnClause, Select, bindparam, func, literal_column, select
from sqlalchemy.orm import Session

from spinewatch.imaging.header import ImageHeader
from store.database import Database
from store.errors import ImageDamagedError, NotFoundError
from store.tables.images import Image, SentImage

Value = TypeVar("Value")

PART_BYTES = 2**18
"""Bytes of a part of an image that is read at once."""


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
    NotFoundError
        The image was removed meanwhile.
    """
    stored = _one(session, select(Image.content).where(Image.sha256 == sha256))
    _require(digest(stored), sha256)
    return stored


def checked_parts(database: Database, image: Image) -> Iterator[bytes]:
    """Return the bytes of a stored image in parts, all of which are checked against their SHA-256 before the first.

    No part is in memory before it is asked for, and no session is open between two of them.

    Parameters
    ----------
    database
        The database.
    image
        The row of the image.

    Returns
    -------
    iterator of bytes
        The parts of the file, of at most ``PART_BYTES``.

    Raises
    ------
    ImageDamagedError
        The stored bytes are not those that were stored first.
    NotFoundError
        The image was removed meanwhile.
    """
    found = hashlib.sha256()
    for part in _parts(database, image):
        found.update(part)
    _require(found.hexdigest(), image.sha256)
    return _parts(database, image)


def _parts(database: Database, image: Image) -> Iterator[bytes]:
    for start in range(0, image.size_bytes, PART_BYTES):
        with database.read() as session:
            part = _part(session, image.sha256, start)
        yield part  # the client may read it late: nothing of the database is held until then


def _part(session: Session, sha256: str, start: int) -> bytes:
    """Return a part of a file from a place on, without the rest of it: SQLite reads all for a function of a value."""
    connection = session.connection()
    if connection.dialect.name != "sqlite":
        query = select(func.substring(Image.content, start + 1, PART_BYTES))
        return bytes(_one(session, query.where(Image.sha256 == sha256)))
    rowid: ColumnClause[int] = literal_column("rowid")
    row = _one(session, select(rowid).select_from(Image).where(Image.sha256 == sha256))
    driver = connection.connection.driver_connection
    assert isinstance(driver, sqlite3.Connection)  # noqa: S101 - what the dialect says
    with driver.blobopen(Image.__tablename__, Image.content.name, row, readonly=True) as file:
        file.seek(start)
        return file.read(PART_BYTES)


def _one(session: Session, query: Select[Value]) -> Value:
    """Return what is stored of an image; raise ``NotFoundError`` when the image was removed since its row was read."""
    found = session.scalars(query).one_or_none()
    if found is None:
        raise NotFoundError("image")
    return found


def _require(found: str, sha256: str) -> None:
    if found != sha256:
        raise ImageDamagedError(
            f"the stored image {sha256[:12]} is damaged: it differs from its SHA-256; restore a backup from before, and"
            " check the disk"
        )


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
