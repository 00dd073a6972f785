"""Deletion of surgeries: a tombstone hides one at once, a purge removes its rows and the images that only it had.

The events of the audit stay: they name identifiers, never a case number. The database itself refuses to delete what
no purge names (migration 0014).
"""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from datetime import datetime, timedelta

from sqlalchemy import ColumnElement, Table, bindparam, func, insert, or_, select
from sqlalchemy import delete as delete_from
from sqlalchemy.orm import Session

from contract.event import Actor
from contract.job import FINAL_STATES
from store import events, jobs, stages
from store.database import Database, sqlite_path
from store.errors import NotFoundError, SurgeryDeletedError
from store.tables.access import IdempotencyKey
from store.tables.base import Base
from store.tables.calibrations import CalibrationShot
from store.tables.images import Image, SentImage
from store.tables.jobs import Job
from store.tables.spines import Radiograph
from store.tables.stages import FurtherPair, Stage
from store.tables.surgeries import Purge, PurgedImage, Surgery, Tombstone

_KEPT = frozenset({"events", "tombstones", "purges", "purged_images"})
"""Tables that a purge removes nothing from."""

_BATCH = 500
_DELETED_AT = select(Tombstone.deleted_at).where(Tombstone.surgery_id == bindparam("surgery_id"))


@dataclass(frozen=True)
class Purged:
    """What a purge removed.

    Attributes
    ----------
    stages
        Takes of stages.
    images
        Images that nothing else used.
    rows
        All rows.
    """

    stages: int
    images: int
    rows: int


def require_present(session: Session, surgery_id: str) -> None:
    """Check that a surgery was not deleted.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery; one that never existed passes.

    Raises
    ------
    SurgeryDeletedError
        It was deleted.
    """
    deleted_at = session.connection().execute(_DELETED_AT, {"surgery_id": surgery_id}).scalar()
    if deleted_at is not None:
        raise SurgeryDeletedError(
            f"this surgery was deleted on {deleted_at:%Y-%m-%d}; an administrator may have an export of it"
        )


def is_present() -> ColumnElement[bool]:
    """Return the condition for surgeries in a query that were not deleted.

    Returns
    -------
    ColumnElement
        The condition.
    """
    return Surgery.id.not_in(select(Tombstone.surgery_id))


def delete(session: Session, surgery_id: str, reason: str | None, now: datetime, actor: Actor) -> None:
    """Hide a surgery and cancel its jobs; everything stays in the database until it is purged.

    Parameters
    ----------
    session
        Session that writes.
    surgery_id
        Identifier of the surgery.
    reason
        Why, without any name; None when it was not said.
    now
        Time of the deletion.
    actor
        Who deletes it.

    Raises
    ------
    NotFoundError
        There is no such surgery.
    SurgeryDeletedError
        It was deleted before.
    """
    require_present(session, surgery_id)
    if session.get(Surgery, surgery_id) is None:
        raise NotFoundError("surgery")
    for job in session.scalars(select(Job).where(Job.state.not_in(tuple(FINAL_STATES)))).all():
        if job.surgery_id == surgery_id:
            jobs.cancel(session, job.id, now, actor)
    session.flush()
    session.execute(
        insert(Tombstone).values(
            surgery_id=surgery_id,
            deleted_at=now,
            actor_kind=actor.kind.value,
            actor_name=actor.name,
            reason=reason,
        )
    )
    events.append(session, now, actor, events.Action.SURGERY_DELETED, surgery_id, surgery_id)


def purge(
    session: Session, surgery_id: str, reason: str, export_sha256: str | None, now: datetime, actor: Actor
) -> Purged:
    """Remove every row of a surgery, and the images that nothing else uses.

    Parameters
    ----------
    session
        Session that writes.
    surgery_id
        Identifier of the surgery, deleted before or not.
    reason
        Why, without any name.
    export_sha256
        SHA-256 of the export of the surgery, hexadecimal; None when none was made.
    now
        Time of the purge.
    actor
        Who purges it.

    Returns
    -------
    Purged
        What was removed.

    Raises
    ------
    NotFoundError
        There is no such surgery.
    """
    if session.get(Surgery, surgery_id) is None:
        raise NotFoundError("surgery")
    if session.get(Tombstone, surgery_id) is None:
        delete(session, surgery_id, reason, now, actor)
    if session.get_bind().dialect.name == "sqlite":
        session.connection().exec_driver_sql(
            "PRAGMA secure_delete=ON"
        )  # freed pages are overwritten with zeros
    session.flush()
    detail = "without an export" if export_sha256 is None else f"export with SHA-256 {export_sha256}"
    events.append(session, now, actor, events.Action.SURGERY_PURGED, surgery_id, surgery_id, detail=detail)
    session.execute(
        insert(Purge).values(
            surgery_id=surgery_id,
            purged_at=now,
            actor_kind=actor.kind.value,
            actor_name=actor.name,
            reason=reason,
            export_sha256=export_sha256,
        )
    )
    stage_ids, images = stages_of(session, surgery_id), images_of(session, surgery_id)
    session.expunge_all()
    rows = _delete_jobs(session, surgery_id, stage_ids)
    for table, condition in reversed(list(conditions(surgery_id, stage_ids))):
        rows += _count(session, table, condition)
        session.execute(delete_from(table).where(condition))
    session.execute(
        delete_from(IdempotencyKey).where(IdempotencyKey.body.contains(surgery_id, autoescape=True))
    )
    unused = [sha256 for sha256 in images if not _is_used(session, sha256)]
    for sha256 in unused:
        session.execute(insert(PurgedImage).values(sha256=sha256, surgery_id=surgery_id))
        session.execute(delete_from(SentImage).where(SentImage.sha256 == sha256))
        session.execute(delete_from(Image).where(Image.sha256 == sha256))
    return Purged(len(stage_ids), len(unused), rows + len(unused))


def expired(session: Session, now: datetime, age: timedelta) -> list[str]:
    """Return the surgeries to which nothing was added for some time.

    Parameters
    ----------
    session
        Session that reads.
    now
        The time.
    age
        The time for which nothing was added.

    Returns
    -------
    list of str
        Identifiers, oldest surgery first; also of surgeries that are hidden.
    """
    last = select(func.max(Stage.created_at)).where(Stage.surgery_id == Surgery.id).scalar_subquery()
    query = select(Surgery.id).where(func.coalesce(last, Surgery.created_at) < now - age)
    return list(session.scalars(query.order_by(Surgery.created_at, Surgery.id)))


def stages_of(session: Session, surgery_id: str) -> list[str]:
    """Return the takes of the stages of a surgery.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.

    Returns
    -------
    list of str
        Identifiers, in the order of the stages.
    """
    query = select(Stage.id).where(Stage.surgery_id == surgery_id)
    return list(session.scalars(query.order_by(*stages.IN_ORDER)))


def images_of(session: Session, surgery_id: str) -> list[str]:
    """Return the images of a surgery.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.

    Returns
    -------
    list of str
        Each SHA-256 once, in order.
    """
    found: set[str] = set()
    queries = (
        select(Stage.left_sha256, Stage.right_sha256).where(Stage.surgery_id == surgery_id),
        select(FurtherPair.left_sha256, FurtherPair.right_sha256)
        .join(Stage, Stage.id == FurtherPair.stage_id)
        .where(Stage.surgery_id == surgery_id),
        select(Radiograph.image_sha256).where(Radiograph.surgery_id == surgery_id),
    )
    for query in queries:
        found.update(sha256 for row in session.execute(query) for sha256 in row)
    return sorted(found)


def conditions(surgery_id: str, stage_ids: list[str]) -> Iterator[tuple[Table, ColumnElement[bool]]]:
    """Yield every table with rows of a surgery, and which rows these are; tables that others refer to come first.

    Parameters
    ----------
    surgery_id
        Identifier of the surgery.
    stage_ids
        Identifiers of its stages.

    Yields
    ------
    tuple of Table and ColumnElement
        The table and the condition.
    """
    for table in Base.metadata.sorted_tables:
        if table.name in _KEPT:
            continue
        if table.name == Surgery.__tablename__:
            yield table, table.c.id == surgery_id
        elif "surgery_id" in table.c:
            yield table, table.c.surgery_id == surgery_id
        elif "stage_id" in table.c:
            yield table, or_(*(table.c.stage_id.in_(part) for part in _parts(stage_ids)))


def erase(database: Database, *, vacuum: bool = True, seconds: float = 30.0) -> bool:
    """Write what a purge removed out of the files of an SQLite database, so that no byte of it is left.

    Parameters
    ----------
    database
        The database.
    vacuum
        Also rebuild the file, without remains of rows that were moved inside it earlier; nobody can write meanwhile.
    seconds
        Longest time to wait for others that read or write.

    Returns
    -------
    bool
        Whether that is done; False when others used the database all the time, or for a database on a server.
    """
    path = sqlite_path(database.url)
    if path is None:
        return False
    if vacuum:
        try:
            with closing(sqlite3.connect(path, isolation_level=None, timeout=seconds)) as connection:
                connection.execute("PRAGMA secure_delete=ON")
                connection.execute("VACUUM")
        except sqlite3.OperationalError:
            return False
    return database.checkpoint(seconds)


def _delete_jobs(session: Session, surgery_id: str, stage_ids: list[str]) -> int:
    """Delete the jobs of a surgery and return their number."""
    subjects = or_(*(Job.subject_id.in_(part) for part in _parts([surgery_id, *stage_ids])))
    number = _count(session, Base.metadata.tables[Job.__tablename__], subjects)
    session.execute(delete_from(Job).where(subjects), execution_options={"synchronize_session": False})
    return number


def _count(session: Session, table: Table, condition: ColumnElement[bool]) -> int:
    return session.scalar(select(func.count()).select_from(table).where(condition)) or 0


def _is_used(session: Session, sha256: str) -> bool:
    columns = [
        Stage.left_sha256,
        Stage.right_sha256,
        FurtherPair.left_sha256,
        FurtherPair.right_sha256,
        Radiograph.image_sha256,
        CalibrationShot.left_sha256,
        CalibrationShot.right_sha256,
    ]
    return any(session.scalar(select(column).where(column == sha256).limit(1)) for column in columns)


def _parts(identifiers: list[str]) -> list[list[str]]:
    """Return identifiers in parts that fit into one statement; one part at least."""
    return [identifiers[n : n + _BATCH] for n in range(0, max(len(identifiers), 1), _BATCH)]
