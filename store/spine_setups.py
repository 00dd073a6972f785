"""Setups of the spine in the database: each change is a new revision, and re-clamped markers are a list that grows."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from itertools import zip_longest
from typing import Any

from sqlalchemy import Row, bindparam, select
from sqlalchemy.orm import Session

from contract.event import Actor
from contract.setup_checks import SurgeryContext
from contract.spine_setup import (
    NewRebaseline,
    SetupRevision,
    SpineSetup,
    StoredRebaseline,
    StoredSpineSetup,
)
from contract.text import STORED
from store import events, radiographs, stages, surgeries, tables
from store.errors import RebaselineExistsError, SetupMissingError


def put(session: Session, surgery_id: str, setup: SpineSetup, now: datetime, actor: Actor) -> bool:
    """Store a setup as the next revision, unless it is the latest one already.

    Parameters
    ----------
    session
        Session that writes.
    surgery_id
        Identifier of the surgery, which exists.
    setup
        The setup.
    now
        Time of the change.
    actor
        Who changes it.

    Returns
    -------
    bool
        Whether there is a new revision.
    """
    _lock(session, surgery_id)
    latest = _latest(session, surgery_id)
    if latest is not None and _read(latest.document) == setup:
        return False
    document = setup.model_dump(mode="json")
    revision = 1 if latest is None else latest.revision + 1
    session.add(
        tables.spines.SpineSetup(surgery_id=surgery_id, revision=revision, document=document, created_at=now)
    )
    session.flush()
    events.append(session, now, actor, events.Action.SPINE_CONFIGURED, surgery_id, surgery_id)
    return True


def find(session: Session, surgery_id: str) -> StoredSpineSetup | None:
    """Return the latest setup of a surgery.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.

    Returns
    -------
    StoredSpineSetup or None
        The setup with all re-clamped markers, None without one.
    """
    row = _latest(session, surgery_id)
    return None if row is None else _stored(row, rebaselines(session, surgery_id))


def get(session: Session, surgery_id: str) -> StoredSpineSetup:
    """Return the latest setup of a surgery.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.

    Returns
    -------
    StoredSpineSetup
        The setup with all re-clamped markers.

    Raises
    ------
    NotFoundError
        There is no such surgery.
    SetupMissingError
        The surgery has no setup.
    """
    found = find(session, surgery_id)
    if found is None:
        surgeries.get(session, surgery_id)
        raise SetupMissingError
    return found


def revisions(session: Session, surgery_id: str) -> list[SetupRevision]:
    """Return every revision of a surgery's setup, oldest first.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.

    Returns
    -------
    list of SetupRevision
        The setups; each has the markers that had been clamped again before the next revision, and who stored it.

    Raises
    ------
    NotFoundError
        There is no such surgery.
    """
    surgeries.get(session, surgery_id)
    query = select(tables.spines.SpineSetup).where(tables.spines.SpineSetup.surgery_id == surgery_id)
    rows = session.scalars(query.order_by(tables.spines.SpineSetup.revision)).all()
    known = rebaselines(session, surgery_id)
    actors = _actors(session, surgery_id)
    ends = [row.created_at for row in rows[1:]]
    return [
        SetupRevision(
            **dict(_stored(row, [item for item in known if end is None or item.created_at < end])),
            actor=actors.get(row.created_at),
        )
        for row, end in zip_longest(rows, ends)
    ]


def context(session: Session, surgery_id: str) -> SurgeryContext:
    """Return what a setup of a surgery must agree with.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.

    Returns
    -------
    SurgeryContext
        Vertebrae, stages and radiographs of the surgery.

    Raises
    ------
    NotFoundError
        There is no such surgery.
    """
    surgery = surgeries.get(session, surgery_id)
    names = select(tables.stages.Stage.name).where(tables.stages.Stage.surgery_id == surgery_id)
    return SurgeryContext(
        vertebrae=surgery.vertebrae,
        reference_vertebra=surgery.reference_vertebra,
        extra_levels=surgery.extra_levels,
        stages=list(dict.fromkeys(session.scalars(names.order_by(*stages.IN_ORDER)))),
        radiographs=radiographs.kinds(session, surgery_id),
    )


def rebaselines(session: Session, surgery_id: str) -> list[StoredRebaseline]:
    """Return the markers that were clamped again.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.

    Returns
    -------
    list of StoredRebaseline
        In the order in which they were stored.
    """
    rows = session.connection().execute(_REBASELINES, {"surgery_id": surgery_id})
    return [StoredRebaseline.model_validate(row) for row in rows]


def add_rebaseline(
    session: Session, surgery_id: str, new: NewRebaseline, now: datetime, actor: Actor
) -> StoredRebaseline:
    """Add a marker that was clamped again.

    Parameters
    ----------
    session
        Session that writes.
    surgery_id
        Identifier of the surgery, which has a setup.
    new
        The vertebra, and the stages before and after.
    now
        Time of the change.
    actor
        Who adds it.

    Returns
    -------
    StoredRebaseline
        What is stored.

    Raises
    ------
    RebaselineExistsError
        A marker of this vertebra was clamped again before the same stage already.
    """
    _lock(session, surgery_id)
    known = rebaselines(session, surgery_id)
    if any((item.vertebra, item.after) == (new.vertebra, new.after) for item in known):
        raise RebaselineExistsError(
            f"the marker of {new.vertebra} was stored as clamped again before stage {new.after} already;"
            " nothing is left to do"
        )
    row = tables.spines.SpineRebaseline(
        surgery_id=surgery_id, position=len(known), **new.model_dump(), created_at=now
    )
    session.add(row)
    session.flush()
    events.append(session, now, actor, events.Action.SPINE_REBASELINED, surgery_id, surgery_id)
    return StoredRebaseline.model_validate(row)


def _lock(session: Session, surgery_id: str) -> None:
    """Let one transaction at a time count on from the latest revision or marker."""
    session.scalars(
        select(tables.surgeries.Surgery.id).where(tables.surgeries.Surgery.id == surgery_id).with_for_update()
    ).one()


def _latest(session: Session, surgery_id: str) -> Row[Any] | None:
    return session.connection().execute(_LATEST, {"surgery_id": surgery_id}).one_or_none()


def _actors(session: Session, surgery_id: str) -> dict[datetime, str]:
    """Return who stored a setup of a surgery, by the time of it, which setup and event share."""
    query = select(tables.events.Event.at, tables.events.Event.actor_name).where(
        tables.events.Event.surgery_id == surgery_id,
        tables.events.Event.action == events.Action.SPINE_CONFIGURED,
    )
    return {row.at: row.actor_name for row in session.execute(query)}


def _read(document: Any) -> SpineSetup:
    return SpineSetup.model_validate(document, context=STORED)


def _stored(row: tables.spines.SpineSetup | Row[Any], known: Sequence[StoredRebaseline]) -> StoredSpineSetup:
    return StoredSpineSetup(
        surgery_id=row.surgery_id,
        revision=row.revision,
        created_at=row.created_at,
        setup=_read(row.document),
        rebaselines=list(known),
    )


_LATEST = (
    select(*tables.spines.SpineSetup.__table__.columns)
    .where(tables.spines.SpineSetup.surgery_id == bindparam("surgery_id"))
    .order_by(tables.spines.SpineSetup.revision.desc())
    .limit(1)
)
_REBASELINES = (
    select(*tables.spines.SpineRebaseline.__table__.columns)
    .where(tables.spines.SpineRebaseline.surgery_id == bindparam("surgery_id"))
    .order_by(tables.spines.SpineRebaseline.position)
)
