import io
import json
import zipfile
from hashlib import sha256
from typing import Any

import pytest
from sqlalchemy import text

from store.case_file import read_case, write_case
from store.database import Database
from store.errors import ExportFileError, ImageDamagedError, NotFoundError
from tests.store.at_rest import without_triggers
from tests.store.builders import NOON, image, new_surgery
from tests.store.test_retention import whole_surgery


@pytest.fixture
def surgery(database: Database) -> str:
    return whole_surgery(database)


def written(database: Database, surgery: str) -> tuple[bytes, str]:
    stream = io.BytesIO()
    with database.read() as session:
        digest = write_case(session, surgery, stream, "1.0", NOON)
    return stream.getvalue(), digest


def test_an_export_has_every_row_image_and_event(database: Database, surgery: str) -> None:
    new_surgery(database)
    content, digest = written(database, surgery)
    assert sha256(content).hexdigest() == digest
    manifest = read_case(io.BytesIO(content))
    assert (manifest["surgery_id"], manifest["spinewatch"]) == (surgery, "1.0")
    rows: dict[str, Any] = manifest["rows"]
    assert (
        rows["surgeries"]
        == rows["stages"]
        == rows["spines"]
        == rows["radiographs"]
        == rows["calibrations"]
        == 1
    )
    assert (rows["triads"], rows["features"], rows["images"], rows["jobs"]) == (2, 2, 3, 2)
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert archive.read(f"images/{image(b'left').sha256}") == b"left"
        events = [json.loads(line) for line in archive.read("audit.jsonl").splitlines()]
        row = json.loads(archive.read("tables/surgeries.jsonl"))
        assert "content" not in json.loads(archive.read("tables/images.jsonl").splitlines()[0])
    assert row["reference"] == "2026-0417"
    assert {event["surgery_id"] for event in events} == {surgery}
    assert "stage:measured" in {event["action"] for event in events}


def test_the_same_surgery_gives_the_same_bytes(database: Database, surgery: str) -> None:
    assert written(database, surgery) == written(database, surgery)


def test_a_damaged_image_stops_the_export(database: Database, surgery: str) -> None:
    with without_triggers(database.url, "images") as session:
        session.execute(text("UPDATE images SET content = :content"), {"content": b"x"})
    with pytest.raises(ImageDamagedError):
        written(database, surgery)


def test_there_is_no_export_of_no_surgery(database: Database) -> None:
    with pytest.raises(NotFoundError):
        written(database, "none")


def changed(content: bytes, name: str, new: bytes | None) -> io.BytesIO:
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(stream, "w") as archive:
        for entry in old.namelist():
            if entry != name:
                archive.writestr(entry, old.read(entry))
            elif new is not None:
                archive.writestr(entry, new)
    return stream


@pytest.mark.parametrize("name", ["audit.jsonl", "tables/stages.jsonl", f"images/{image(b'left').sha256}"])
@pytest.mark.parametrize("new", [b"x", None])
def test_a_damaged_export_is_noticed(database: Database, surgery: str, name: str, new: bytes | None) -> None:
    content, _ = written(database, surgery)
    with pytest.raises(ExportFileError, match="damaged"):
        read_case(changed(content, name, new))


@pytest.mark.parametrize("new", [b"", b"[]", b"{}", b'{"rows": {}, "sha256": {}}', None])
def test_what_is_no_export_is_named(database: Database, surgery: str, new: bytes | None) -> None:
    content, _ = written(database, surgery)
    with pytest.raises(ExportFileError):
        read_case(changed(content, "manifest.json", new))
    with pytest.raises(ExportFileError):
        read_case(io.BytesIO(b"no ZIP file"))
