from sqlalchemy import func, select

from store import images
from store.database import Database
from store.tables import Image
from tests.store.builders import NOON, image, new_stage, new_surgery


def test_the_same_image_is_one_row(database: Database) -> None:
    surgery = new_surgery(database)
    new_stage(database, surgery, "A", (b"1", b"2"))
    new_stage(database, surgery, "B", (b"2", b"3"))
    with database.read() as session:
        assert session.scalar(select(func.count()).select_from(Image)) == 3


def test_the_bytes_come_back(database: Database) -> None:
    with database.write() as session:
        row = images.add(session, image(b"content"), NOON)
    with database.read() as session:
        assert images.content(session, row.sha256) == b"content"
    assert (row.width, row.height, row.size_bytes) == (568, 416, 7)
