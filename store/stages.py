"""Stages in the database: takes, the one whose results count, lists, and images."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime

from sqlalchemy import Select, bindparam, exists, select
from sqlalchemy.orm import Session, aliased, joinedload

from contract.job import JobState
from contract.measuring import Measuring
from store.errors import (
    NotFoundError,
)
from store.page import Page, PageRequest, created_within, page_of
from store.tables.images import Image
from store.tables.jobs import Job
from store.tables.measurements import Measurement
from store.tables.stages import FurtherPair, Stage
from store.tables.surgeries import Surgery

IN_ORDER = (Stage.place, Stage.take)
"""The order of the stages of a surgery: that in which their names were first submitted; takes of a name by number."""


def find(session: Session, surgery_id: str, name: str) -> Stage | None:
    """Return the latest take of a stage with its images, job and measurement.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.
    name
        Name of the stage.

    Returns
    -------
    Stage or None
        The row, None when there is no such stage.
    """
    return session.scalars(_LATEST, {"surgery_id": surgery_id, "name": name}).first()


def get(session: Session, surgery_id: str, name: str, take: int | None = None) -> Stage:
    """Return a take of a stage with its images, job and measurement.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.
    name
        Name of the stage.
    take
        Number of the take; None for the latest.

    Returns
    -------
    Stage
        The row.

    Raises
    ------
    NotFoundError
        There is no such surgery, stage or take.
    """
    wanted = {"surgery_id": surgery_id, "name": name}
    if take is None:
        stage = session.scalars(_LATEST, wanted).first()
    else:
        stage = session.scalars(_TAKE, {**wanted, "take": take}).one_or_none()
    if stage is None:
        if session.get(Surgery, surgery_id) is None:
            raise NotFoundError("surgery")
        raise NotFoundError("stage" if take is None or find(session, surgery_id, name) is None else "take")
    return stage


def takes(session: Session, surgery_id: str, name: str) -> Sequence[Stage]:
    """Return all takes of a stage.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.
    name
        Name of the stage.

    Returns
    -------
    sequence of Stage
        The rows with images, job and measurement, latest take first.

    Raises
    ------
    NotFoundError
        There is no such surgery or stage.
    """
    found = session.scalars(_TAKES, {"surgery_id": surgery_id, "name": name}).all()
    return found or [get(session, surgery_id, name)]


def measured(session: Session, surgery_id: str, name: str, take: int | None = None) -> Stage:
    """Return the take of a stage whose results count, with its images, job and measurement.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.
    name
        Name of the stage.
    take
        Number of another take, None for the one whose results count.

    Returns
    -------
    Stage
        The latest take that was measured; the latest one if none was.

    Raises
    ------
    NotFoundError
        There is no such surgery, stage or take.
    """
    if take is not None:
        return get(session, surgery_id, name, take)
    found = session.scalars(_MEASURED, {"surgery_id": surgery_id, "name": name}).first()
    return get(session, surgery_id, name) if found is None else found


def counting(surgery_id: str) -> Select[str]:
    """Return the query for the takes whose results count: of each stage the latest one that was measured.

    Parameters
    ----------
    surgery_id
        Identifier of the surgery.

    Returns
    -------
    Select
        Identifiers of the takes.
    """
    later, result = aliased(Stage), aliased(Measurement)
    superseded = (
        select(later.id)
        .join(result, result.stage_id == later.id)
        .where(later.surgery_id == surgery_id, later.name == Stage.name, later.take > Stage.take)
        .exists()
    )
    query = select(Stage.id).join(Measurement, Measurement.stage_id == Stage.id)
    return query.where(Stage.surgery_id == surgery_id, ~superseded)


def image(session: Session, stage: Stage, pair: int, side: str) -> Image:
    """Return an image of a stage.

    Parameters
    ----------
    session
        Session that reads.
    stage
        The stage.
    pair
        Number of the pair, from 1.
    side
        left or right.

    Returns
    -------
    Image
        The row.

    Raises
    ------
    NotFoundError
        The stage has no such pair.
    """
    if pair > stage.pair_count:
        raise NotFoundError("pair")
    found = stage if pair == 1 else session.get_one(FurtherPair, (stage.id, pair - 1))
    return session.get_one(Image, sha256_by_side(found)[side])


def listed(
    session: Session,
    surgery_id: str,
    wanted: PageRequest,
    *,
    name: str | None = None,
    state: JobState | None = None,
    calibration_id: str | None = None,
    created_after: datetime | None = None,
    created_before: datetime | None = None,
) -> Page[Stage]:
    """Return a page of a surgery's stages, every take.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.
    wanted
        Which part of the list.
    name
        Only takes of the stage of this name.
    state
        Only those whose job is in this state.
    calibration_id
        Only those of this calibration.
    created_after, created_before
        Only those created at the first time or later, and before the second one.

    Returns
    -------
    Page of Stage
        The rows with images, job and measurement.
    """
    query = created_within(select(Stage), Stage, created_after, created_before)
    query = query.where(Stage.surgery_id == surgery_id)
    if name is not None:
        query = query.where(Stage.name == name)
    if state is not None:
        query = query.where(Stage.job.has(Job.state == state))
    if calibration_id is not None:
        query = query.where(Stage.calibration_id == calibration_id)
    return page_of(session, query.options(*_WHOLE), Stage, wanted)


def sha256_by_side(pair: Stage | FurtherPair) -> dict[str, str]:
    """Return the SHA-256 of the images of a pair.

    Parameters
    ----------
    pair
        The row of a stage or of a further pair of a burst.

    Returns
    -------
    dict of str to str
        Hexadecimal, by side.
    """
    return {"left": pair.left_sha256, "right": pair.right_sha256}


def measuring_of(session: Session, stage: Stage) -> Measuring:
    """Return how the images of a take are measured, as it was sent with them.

    Parameters
    ----------
    session
        Session that reads.
    stage
        The take; a revision has the images of an earlier one.

    Returns
    -------
    Measuring
        What is known of the pairs; nothing when nothing was sent.
    """
    take, changes = stage.revised_take, stage.changes
    while take is not None:
        query = takes_of(stage.surgery_id, stage.name).where(Stage.take == take)
        revised = session.scalars(query).one()
        take, changes = revised.revised_take, revised.changes
    return Measuring() if changes is None else Measuring.model_validate(changes)


def takes_of(surgery_id: str, name: str) -> Select[Stage]:
    """Return the query for the takes of a stage.

    Parameters
    ----------
    surgery_id
        Identifier of the surgery.
    name
        Name of the stage.

    Returns
    -------
    Select
        The rows, latest take first.
    """
    found = select(Stage).where(Stage.surgery_id == surgery_id, Stage.name == name)
    return found.order_by(Stage.take.desc())


_WHOLE = (
    joinedload(Stage.job),
    joinedload(Stage.calibration),
    joinedload(Stage.left),
    joinedload(Stage.right),
    joinedload(Stage.measurement),
)
_OF = (Stage.surgery_id == bindparam("surgery_id"), Stage.name == bindparam("name"))
_IS_MEASURED = exists().where(Measurement.stage_id == Stage.id)
_TAKES = select(Stage).where(*_OF).order_by(Stage.take.desc()).options(*_WHOLE)
_LATEST = _TAKES.limit(1)
_TAKE = select(Stage).where(*_OF, Stage.take == bindparam("take")).options(*_WHOLE)
_MEASURED = _LATEST.where(_IS_MEASURED)
