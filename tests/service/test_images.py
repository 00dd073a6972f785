import asyncio
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path

import pytest
from fastapi.responses import StreamingResponse
from sqlalchemy.orm import Session

from service.images import file_response, image_pair
from spinewatch.imaging.header import inspect_image
from store import images
from store.database import Database
from store.images import NewImage
from store.tables.images import Image
from tests.backends import new_database
from tests.paths import SAMPLES

CONTENT = (SAMPLES / "D1" / "PRE" / "left.png").read_bytes()


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    with new_database(tmp_path) as url:
        database = Database(url)
        yield database
        database.close()


def stored(session: Session) -> Image:
    return images.add(session, NewImage(CONTENT, inspect_image(CONTENT)), datetime.now(UTC))


def test_a_file_is_sent_unless_the_client_has_it(database: Database) -> None:
    with database.write() as session:
        row = stored(session)
    response = file_response(database, row, None)
    assert (response.status_code, response.body) == (200, CONTENT)
    assert response.headers["etag"] == f'"{row.sha256}"'
    assert response.headers["x-content-type-options"] == "nosniff"
    assert file_response(database, row, f'W/"{row.sha256}"').status_code == 304
    assert file_response(database, row, '"other"').status_code == 200


def test_a_large_file_is_sent_in_parts(database: Database, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(images, "PART_BYTES", 10_000)
    with database.write() as session:
        row = stored(session)
    response = file_response(database, row, None)
    assert response.headers["content-length"] == str(len(CONTENT))
    assert response.headers["etag"] == f'"{row.sha256}"'

    async def parts() -> list[bytes]:
        assert isinstance(response, StreamingResponse)
        return [bytes(part) async for part in response.body_iterator]  # type: ignore[arg-type]

    found = asyncio.run(parts())
    assert b"".join(found) == CONTENT
    assert max(map(len, found)) == 10_000


def test_the_tag_of_a_file_is_compared_as_a_whole(database: Database) -> None:
    with database.write() as session:
        row = stored(session)
    for header in ("*", f'"other", "{row.sha256}"'):
        assert file_response(database, row, header).status_code == 304
    for header in ("", row.sha256, f'"{row.sha256}xxxx"', f"{row.sha256}xxxx"):
        assert file_response(database, row, header).status_code == 200


def test_a_pair_is_described_without_its_content(database: Database) -> None:
    with database.write() as session:
        row = stored(session)
        pair = image_pair(row, row)
    assert (pair.left.width_px, pair.left.height_px, pair.left.size_bytes) == (568, 416, len(CONTENT))
    assert pair.right == pair.left
