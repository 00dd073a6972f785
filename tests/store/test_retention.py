import sqlite3
from contextlib import closing
from datetime import timedelta
from pathlib import Path

import pytest
from sqlalchemy import func, select, text
from sqlalchemy.exc import IntegrityError

from contract.job import JobState
from contract.pair_result import PairResult
from spinewatch.imaging.pixel_spacing import SpacingSource
from store import (
    events,
    images,
    jobs,
    pair_results,
    radiographs,
    retention,
    spine_jobs,
    spine_setups,
    spines,
    surgeries,
)
from store.audit import verify_chain
from store.database import Database, sqlite_path
from store.errors import NotFoundError, SurgeryDeletedError
from store.images import NewImage
from store.page import PageRequest
from store.radiographs import NewRadiograph
from store.spines import ComputedSpine
from store.tables.base import Base
from store.tables.events import Event
from store.tables.images import Image, SentImage
from store.tables.surgeries import Purge, Surgery, Tombstone
from tests.backends import about_the_sqlite_file
from tests.contract.spine_results import stage_spine
from tests.store.builders import (
    CLIENT,
    NOON,
    WORKER,
    at,
    claimed,
    image,
    new_request,
    new_stage,
    new_surgery,
    spine_setup,
    succeed,
)

RADIOGRAPH = NewRadiograph("pa", "right", (0.1, 0.1), SpacingSource.PIXEL_SPACING, image(b"radiograph"))
KEPT = {"events", "tombstones", "purges", "purged_images"}


def whole_surgery(database: Database, left: bytes = b"left", right: bytes = b"right") -> str:
    """A surgery with rows in every table that can have some."""
    surgery = new_surgery(database)
    stage = new_stage(database, surgery, pair=(left, right))
    succeed(database, claimed(database, stage.job.id))
    with database.write() as session:
        pair_results.add(session, stage.id, [pair_results.packed(PairResult())])
        spine_setups.put(session, surgery, spine_setup(), NOON, CLIENT)
        spine_jobs.submit(session, surgery, NOON)
        radiographs.add(session, surgery, RADIOGRAPH, NOON, CLIENT)
    with database.read() as session:
        plans = spines.work(session, surgery).plans
    with database.write() as session:
        spines.add(
            session, surgery, [ComputedSpine(p, stage_spine(0), None) for p in plans], "1", NOON, WORKER
        )
    return surgery


def counts(database: Database) -> dict[str, int]:
    with database.read() as session:
        return {
            table.name: session.scalar(select(func.count()).select_from(table)) or 0
            for table in Base.metadata.sorted_tables
            if table.name not in KEPT
        }


def deleted(database: Database, surgery: str) -> None:
    with database.write() as session:
        retention.delete(session, surgery, "withdrawn", NOON, CLIENT)


def purged(database: Database, surgery: str, export: str | None = None) -> retention.Purged:
    with database.write() as session:
        return retention.purge(session, surgery, "retention", export, NOON, CLIENT)


def test_a_deleted_surgery_is_hidden_and_its_jobs_end(database: Database) -> None:
    surgery, other = new_surgery(database), new_surgery(database)
    job = new_stage(database, surgery).job.id
    lease = claimed(database, job)
    deleted(database, surgery)
    with database.read() as session:
        assert [row.id for row in surgeries.listed(session, PageRequest()).items] == [other]
        assert jobs.get(session, job).state is JobState.CANCELLED
        for read in (surgeries.get, surgeries.get_with_stages, retention.require_present):
            with pytest.raises(SurgeryDeletedError, match="2026-11-21"):
                read(session, surgery)
        row = session.get_one(Tombstone, surgery)
        assert (row.reason, row.actor_name, row.deleted_at) == ("withdrawn", CLIENT.name, NOON)
        assert session.get(Surgery, surgery) is not None
    assert not succeed(database, lease)
    with pytest.raises(SurgeryDeletedError):
        deleted(database, surgery)
    with pytest.raises(SurgeryDeletedError):
        new_stage(database, surgery, "POST")
    with pytest.raises(NotFoundError):
        deleted(database, "none")


def test_a_purge_leaves_nothing_but_tombstone_and_audit(database: Database) -> None:
    new_request(database)
    before = counts(database)
    surgery = whole_surgery(database)
    with database.read() as session:
        last = session.scalar(select(func.max(Event.seq)))
    removed = purged(database, surgery, "f" * 64)
    assert (removed.stages, removed.images) == (1, 3)
    assert counts(database) == before | {"calibrations": before["calibrations"] + 1}
    with database.read() as session:
        row = session.get_one(Purge, surgery)
        assert (row.reason, row.export_sha256, row.purged_at) == ("retention", "f" * 64, NOON)
        assert session.get(Tombstone, surgery) is not None
        with pytest.raises(SurgeryDeletedError):
            surgeries.get(session, surgery)
        new = session.scalars(select(Event).where(Event.seq > last).order_by(Event.seq)).all()
        assert [event.action for event in new] == ["job:cancelled", "surgery:deleted", "surgery:purged"]
        assert "f" * 64 in (new[-1].detail or "")
        assert verify_chain(session).is_whole
        assert "2026-0417" not in str(session.execute(text("SELECT * FROM events")).all())


def test_every_table_of_a_surgery_was_tried(database: Database) -> None:
    whole_surgery(database)
    found = counts(database)
    tried = {table.name for table, _ in retention.conditions("s", ["t"])} - {"further_pairs", "bursts"}
    assert {name for name in tried if not found[name]} <= {"spine_rebaselines"}


def test_images_that_others_use_stay(database: Database) -> None:
    surgery, other = whole_surgery(database, b"1", b"2"), new_surgery(database)
    new_stage(database, other, pair=(b"2", b"3"))
    with database.write() as session:
        images.add(session, NewImage(b"1", image(b"1").header, "e" * 64), NOON)
    purged(database, surgery)
    with database.read() as session:
        kept = set(session.scalars(select(Image.sha256)))
        assert session.scalars(select(SentImage.sha256)).all() == []
    assert kept == {image(b"2").sha256, image(b"3").sha256}
    new_stage(database, other, "AGAIN", pair=(b"1", b"4"))  # the same bytes can come again


def test_nothing_is_deleted_without_a_purge_in_the_audit(database: Database) -> None:
    surgery = whole_surgery(database)
    deleted(database, surgery)
    insert = text(
        "INSERT INTO purges VALUES (:id, '2026-11-21 12:00:00.000000', 'http', 'x', 'x', NULL)"
    ).bindparams(id=surgery)
    with pytest.raises(IntegrityError, match="audit"), database.write() as session:
        session.execute(insert)
    for table in ("stages", "images", "spines", "radiographs", "surgeries", "tombstones"):
        with pytest.raises(IntegrityError, match="never changes"), database.write() as session:
            session.execute(text(f"DELETE FROM {table}"))  # noqa: S608 - names from above
    with database.write() as session:
        events.append(session, NOON, CLIENT, events.Action.SURGERY_PURGED, surgery, surgery)
        session.execute(insert)
        session.execute(text("DELETE FROM spines"))
    with pytest.raises(IntegrityError), database.write() as session:
        session.execute(text("DELETE FROM purges"))


def test_a_purge_that_fails_removes_nothing(database: Database) -> None:
    surgery = whole_surgery(database)
    before = counts(database)
    with database.write() as session:
        retention.purge(session, surgery, "x", None, NOON, CLIENT)
        session.rollback()
    assert counts(database) == before
    with database.read() as session:
        assert surgeries.get(session, surgery).id == surgery
    with pytest.raises(NotFoundError):
        purged(database, "none")


def test_expired_surgeries_are_those_without_a_recent_stage(database: Database) -> None:
    old, busy, new = new_surgery(database), new_surgery(database), new_surgery(database)
    new_stage(database, busy, now=at(90 * 86400))
    with database.write() as session:
        session.get_one(Surgery, new).created_at = at(72 * 86400)
    with database.read() as session:
        now = NOON + timedelta(days=100)
        assert retention.expired(session, now, timedelta(days=99)) == [old]
        assert retention.expired(session, now, timedelta(days=101)) == []
        assert set(retention.expired(session, now, timedelta(days=5))) == {old, busy, new}


@about_the_sqlite_file
def test_no_byte_of_a_purged_surgery_is_left_in_the_files(database: Database, tmp_path: Path) -> None:
    path = sqlite_path(database.url)
    assert path is not None
    left = bytes(range(256)) * 400
    other = new_surgery(database)
    surgery = whole_surgery(database, left, b"right-hand image " * 5000)
    new_stage(database, other, pair=(b"others stay " * 3000, b"y"))

    def traces() -> list[bytes]:
        files = b"".join(file.read_bytes() for file in tmp_path.iterdir() if file.name.startswith(path.name))
        return [
            part
            for part in (left[:600], b"right-hand image", surgery.encode() + b"2026-0417")
            if part in files
        ]

    assert len(traces()) >= 2
    purged(database, surgery)
    with closing(sqlite3.connect(path)) as reader:  # a service has the file open
        reader.execute("SELECT count(*) FROM images").fetchall()
        reader.commit()
        assert retention.erase(database)
        assert traces() == []
        assert (b"others stay " * 50) in path.read_bytes()


@about_the_sqlite_file
def test_without_vacuum_images_are_overwritten_all_the_same(database: Database, tmp_path: Path) -> None:
    surgery = whole_surgery(database, b"left-hand image " * 5000)
    size = _size(tmp_path)
    purged(database, surgery)
    assert retention.erase(database, vacuum=False)
    assert b"left-hand image" not in b"".join(file.read_bytes() for file in tmp_path.iterdir())
    assert _size(tmp_path) <= size


@about_the_sqlite_file
def test_remains_are_reported_while_somebody_reads(database: Database) -> None:
    purged(database, whole_surgery(database))
    with database.read() as session:
        session.execute(text("SELECT count(*) FROM images"))
        assert not retention.erase(database, vacuum=False, seconds=0.1)


def _size(folder: Path) -> int:
    return sum(file.stat().st_size for file in folder.iterdir())
