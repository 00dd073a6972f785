"""Stages in the database: submitting stereo pairs, their takes, and revisions of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from uuid import uuid4

from sqlalchemy import Select, select
from sqlalchemy.orm import Session, aliased, joinedload, selectinload
from sqlalchemy.orm.attributes import set_committed_value

import contract.revision
import contract.triad
from contract.event import Actor
from contract.job import FINAL_STATES, JobState
from store import events, images, jobs
from store.errors import (
    NotFoundError,
    StageExistsError,
    StageNotMeasuredError,
    TakeSupersededError,
)
from store.images import NewImage
from store.page import Page, PageRequest, created_within, page_of
from store.tables import (
    STAGE_JOB,
    Calibration,
    FurtherPair,
    Image,
    Job,
    Measurement,
    Stage,
    Surgery,
)

_REPLACEABLE = frozenset({JobState.FAILED, JobState.CANCELLED})


@dataclass(frozen=True)
class NewPair:
    """A stereo pair of a burst.

    Attributes
    ----------
    left, right
        The images.
    left_exposed_at, right_exposed_at
        When each was exposed, None when unknown.
    """

    left: NewImage
    right: NewImage
    left_exposed_at: datetime | None = None
    right_exposed_at: datetime | None = None


@dataclass(frozen=True)
class NewStage:
    """What was taken at a stage of a surgery: a stereo pair, or a burst.

    Attributes
    ----------
    name
        Name of the stage.
    left, right
        The images of the pair, or of the first pair of the burst.
    captured_at
        When they were taken, None when unknown.
    left_exposed_at, right_exposed_at
        When each was exposed, None when unknown.
    further
        The other pairs of the burst, in the order in which they were taken.
    """

    name: str
    left: NewImage
    right: NewImage
    captured_at: datetime | None
    left_exposed_at: datetime | None = None
    right_exposed_at: datetime | None = None
    further: Sequence[NewPair] = ()


def find_same(session: Session, surgery: Surgery, calibration: Calibration, new: NewStage) -> Stage | None:
    """Return the latest take of a name if it has the same images, in the same order, and the same calibration.

    Parameters
    ----------
    session
        Session that reads.
    surgery
        The surgery.
    calibration
        The calibration that the images were taken with.
    new
        The stereo pair, or the burst.

    Returns
    -------
    Stage or None
        The take, with images, job and measurement; None when it is another one, or its job failed or was cancelled.
    """
    latest = session.scalars(_latest(surgery.id, new.name).options(*_WHOLE)).first()
    if latest is None or latest.job.state in _REPLACEABLE or latest.calibration_id != calibration.id:
        return None
    stored = [sha256_by_side(latest), *map(sha256_by_side, latest.further_pairs)]
    pairs = [(new.left, new.right), *((pair.left, pair.right) for pair in new.further)]
    sent = [{"left": left.sha256, "right": right.sha256} for left, right in pairs]
    return latest if stored == sent else None


def submit(
    session: Session,
    surgery: Surgery,
    calibration: Calibration,
    new: NewStage,
    now: datetime,
    actor: Actor,
    *,
    retake: bool = False,
) -> Stage:
    """Add a stage with its images and its queued job.

    A name in use is the next take when the latest job of that name failed or was cancelled, or on request when it has
    succeeded. Nothing is overwritten.

    Parameters
    ----------
    session
        Session that writes.
    surgery
        The surgery.
    calibration
        The calibration that the images were taken with.
    new
        The stereo pair, or the burst.
    now
        Time of the submission.
    actor
        Who submits.
    retake
        Whether a stage that was measured is taken again.

    Returns
    -------
    Stage
        The row with its job; the caller enqueues the job after the commit.

    Raises
    ------
    StageExistsError
        The latest job of that name is queued, running or, unless it is taken again, has succeeded.
    """
    latest = session.scalars(_latest(surgery.id, new.name).options(joinedload(Stage.job))).first()
    _require_replaceable(latest, retake=retake)
    stage = Stage(
        id=str(uuid4()),
        surgery=surgery,
        name=new.name,
        take=1 if latest is None else latest.take + 1,
        calibration=calibration,
        left=images.add(session, new.left, now),
        right=images.add(session, new.right, now),
        captured_at=new.captured_at,
        left_exposed_at=new.left_exposed_at,
        right_exposed_at=new.right_exposed_at,
        created_at=now,
        measurement=None,
        further_pairs=[
            FurtherPair(
                position=position,
                left=images.add(session, pair.left, now),
                right=images.add(session, pair.right, now),
                left_exposed_at=pair.left_exposed_at,
                right_exposed_at=pair.right_exposed_at,
            )
            for position, pair in enumerate(new.further, start=1)
        ],
    )
    session.add(stage)
    job = jobs.add(session, STAGE_JOB, stage.id, now, {"surgery_id": surgery.id})
    set_committed_value(stage, "job", job)
    events.append(session, now, actor, events.Action.STAGE_SUBMITTED, stage.id, surgery.id)
    return stage


def _require_replaceable(latest: Stage | None, *, retake: bool) -> None:
    """Raise ``StageExistsError`` unless a take may follow the latest one."""
    if latest is None or latest.job.state in _REPLACEABLE:
        return
    state = latest.job.state
    if state is JobState.SUCCEEDED:
        if retake:
            return
        advice = "choose another name, or send retake=true to take the stage again"
    else:
        advice = "wait for its job, or cancel it"
    raise StageExistsError(
        f"this surgery has a stage of that name already and its job is {state.value}; {advice}", latest.job.id
    )


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
    query = _latest(surgery_id, name)
    if take is not None:
        query = query.where(Stage.take == take)
    stage = session.scalars(query.options(*_WHOLE)).first()
    if stage is None:
        if session.get(Surgery, surgery_id) is None:
            raise NotFoundError("surgery")
        if take is not None and session.scalars(_latest(surgery_id, name)).first() is not None:
            raise NotFoundError("take")
        raise NotFoundError("stage")
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
    get(session, surgery_id, name)
    return session.scalars(_takes(surgery_id, name).options(*_WHOLE)).all()


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
    query = _latest(surgery_id, name).where(Stage.id.in_(counting(surgery_id)))
    found = session.scalars(query.options(*_WHOLE)).first()
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


def revise(
    session: Session,
    surgery_id: str,
    name: str,
    changes: contract.revision.NewRevision,
    now: datetime,
    actor: Actor,
) -> Stage:
    """Add a revision of a take: a take with the same images, and its queued job.

    Parameters
    ----------
    session
        Session that writes.
    surgery_id
        Identifier of the surgery.
    name
        Name of the stage.
    changes
        What is to be changed.
    now
        Time of the request.
    actor
        Who asks.

    Returns
    -------
    Stage
        The row with its job; the caller enqueues the job after the commit.

    Raises
    ------
    NotFoundError
        There is no such surgery or stage.
    StageNotMeasuredError
        No take was measured.
    StageExistsError
        A take is queued or running.
    TakeSupersededError
        The take is not the one whose results count.
    """
    latest = get(session, surgery_id, name)
    if latest.job.state not in FINAL_STATES:
        _require_replaceable(latest, retake=True)
    revised = measured(session, surgery_id, name)
    if revised.measurement is None:
        raise StageNotMeasuredError(
            f"stage {name} has no result: its job is {latest.job.state.value}; take the stage again"
        )
    if revised.take != changes.take:
        raise TakeSupersededError(
            f"the results of take {revised.take} count, not those of take {changes.take}; look at them and revise that"
        )
    stage = Stage(
        id=str(uuid4()),
        surgery_id=surgery_id,
        name=name,
        take=latest.take + 1,
        calibration=revised.calibration,
        left=revised.left,
        right=revised.right,
        captured_at=revised.captured_at,
        left_exposed_at=revised.left_exposed_at,
        right_exposed_at=revised.right_exposed_at,
        created_at=revised.created_at,
        revised_take=revised.take,
        changes=changes.model_dump(mode="json"),
        revised_at=now,
        revised_by=actor.name,
        measurement=None,
        further_pairs=[
            FurtherPair(
                position=pair.position,
                left_sha256=pair.left_sha256,
                right_sha256=pair.right_sha256,
                left_exposed_at=pair.left_exposed_at,
                right_exposed_at=pair.right_exposed_at,
            )
            for pair in revised.further_pairs
        ],
    )
    session.add(stage)
    job = jobs.add(session, STAGE_JOB, stage.id, now, {"surgery_id": surgery_id})
    set_committed_value(stage, "job", job)
    events.append(session, now, actor, events.Action.STAGE_REVISED, stage.id, surgery_id)
    return stage


def image(session: Session, stage: Stage, pair: int, side: str) -> Image:
    """Return an image of a stage.

    Parameters
    ----------
    session
        Session that reads.
    stage
        The stage, with its further pairs.
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
    pairs = [sha256_by_side(stage), *map(sha256_by_side, stage.further_pairs)]
    if pair > len(pairs):
        raise NotFoundError("pair")
    return session.get_one(Image, pairs[pair - 1][side])


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


def _latest(surgery_id: str, name: str) -> Select[Stage]:
    return _takes(surgery_id, name).limit(1)


def _takes(surgery_id: str, name: str) -> Select[Stage]:
    found = select(Stage).where(Stage.surgery_id == surgery_id, Stage.name == name)
    return found.order_by(Stage.take.desc())


_WHOLE = (
    joinedload(Stage.job),
    joinedload(Stage.calibration),
    joinedload(Stage.left),
    joinedload(Stage.right),
    joinedload(Stage.measurement).options(selectinload(Measurement.features)),
    selectinload(Stage.further_pairs),
)
