import pytest
from sqlalchemy import func, select, text
from sqlalchemy.pool import QueuePool

from store import images
from store.database import Database
from store.errors import ImageDamagedError, NotFoundError
from store.images import NewImage
from store.tables.images import Image, SentImage
from tests.store.at_rest import without_triggers
from tests.store.builders import NOON, image, new_stage, new_surgery


def test_the_same_image_is_one_row(database: Database) -> None:
    surgery = new_surgery(database)
    new_stage(database, surgery, "A", (b"1", b"2"))
    new_stage(database, surgery, "B", (b"2", b"3"))
    with database.read() as session:
        assert session.scalar(select(func.count()).select_from(Image)) == 3


def test_images_that_come_together_keep_their_order(database: Database) -> None:
    with database.write() as session:
        known = images.add(session, image(b"2"), NOON)
    with database.write() as session:
        rows = images.add_all(session, [image(b"3"), image(b"2"), image(b"1"), image(b"3")], NOON)
    assert [row.sha256 for row in rows] == [image(content).sha256 for content in (b"3", b"2", b"1", b"3")]
    assert rows[1].sha256 == known.sha256
    with database.read() as session:
        assert session.scalar(select(func.count()).select_from(Image)) == 3


def test_the_bytes_come_back(database: Database) -> None:
    with database.write() as session:
        row = images.add(session, image(b"content"), NOON)
    with database.read() as session:
        assert images.content(session, row.sha256) == b"content"
    assert (row.width, row.height, row.size_bytes) == (568, 416, 7)


@pytest.mark.parametrize("damaged", [b"", b"contenT", b"content "])
def test_damaged_bytes_are_never_returned(database: Database, damaged: bytes) -> None:
    with database.write() as session:
        row = images.add(session, image(b"content"), NOON)
    with without_triggers(database.url, "images") as session:
        session.execute(text("UPDATE images SET content = :content"), {"content": damaged})
    with database.read() as session, pytest.raises(ImageDamagedError, match=row.sha256[:12]):
        images.content(session, row.sha256)
    with pytest.raises(ImageDamagedError, match=row.sha256[:12]):
        images.checked_parts(database, row)


def test_an_image_that_was_removed_since_its_row_was_read_is_not_found(database: Database) -> None:
    with database.write() as session:
        row = images.add(session, image(b"content"), NOON)
    parts = images.checked_parts(database, row)
    with without_triggers(database.url, "images") as session:
        session.execute(text("DELETE FROM images"))
    with database.read() as session, pytest.raises(NotFoundError, match="image"):
        images.content(session, row.sha256)
    with pytest.raises(NotFoundError, match="image"):
        images.checked_parts(database, row)
    with pytest.raises(NotFoundError, match="image"):
        list(parts)


def in_use(database: Database) -> int:
    """Return how many connections somebody holds."""
    pool = database.engine.pool
    assert isinstance(pool, QueuePool)
    return pool.checkedout()


@pytest.mark.parametrize("size", [1, 3, 4, 7])
def test_the_bytes_come_back_in_parts(database: Database, size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(images, "PART_BYTES", size)
    with database.write() as session:
        row = images.add(session, image(b"content"), NOON)
    parts = []
    for part in images.checked_parts(database, row):
        assert in_use(database) == 0
        parts.append(part)
    assert b"".join(parts) == b"content"
    assert {len(part) for part in parts[:-1]} <= {size}


def test_the_hash_of_the_file_as_it_was_sent_is_kept(database: Database) -> None:
    sent = ["a" * 64, "b" * 64, "a" * 64]
    with database.write() as session:
        for sha256 in sent:
            images.add(session, NewImage(b"content", image(b"content").header, sha256), NOON)
        images.add(session, image(b"as sent"), NOON)
    with database.read() as session:
        rows = session.scalars(select(SentImage).order_by(SentImage.sent_sha256)).all()
    stored = image(b"content").sha256
    assert [(row.sent_sha256, row.sha256) for row in rows] == [("a" * 64, stored), ("b" * 64, stored)]
