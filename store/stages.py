"""Stages in the database: submitting a stereo pair, and what a worker needs to measure it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from uuid import uuid4

from sqlalchemy import Select, and_, or_, select
from sqlalchemy.orm import Session, joinedload, selectinload
from sqlalchemy.orm.attributes import set_committed_value

from contract.event import Actor
from contract.job import JobState
from store import calibrations, events, images, jobs
from store.errors import NotFoundError, StageExistsError
from store.images import NewImage
from store.page import Page, page_of
from store.tables import STAGE_JOB, Calibration, Document, Measurement, Stage, Surgery

_REPLACEABLE = frozenset({JobState.FAILED, JobState.CANCELLED})


@dataclass(frozen=True)
class NewStage:
    """A stereo pair that was taken at a stage of a surgery.

    Attributes
    ----------
    name
        Name of the stage.
    left, right
        The images.
    captured_at
        When they were taken, None when unknown.
    """

    name: str
    left: NewImage
    right: NewImage
    captured_at: datetime | None


def submit(
    session: Session, surgery: Surgery, calibration: Calibration, new: NewStage, now: datetime, actor: Actor
) -> Stage:
    """Add a stage with its images and its queued job.

    A name in use is the next take when the latest job of that name failed or was cancelled. Nothing is overwritten.

    Parameters
    ----------
    session
        Session that writes.
    surgery
        The surgery.
    calibration
        The calibration that the images were taken with.
    new
        The stereo pair.
    now
        Time of the submission.
    actor
        Who submits.

    Returns
    -------
    Stage
        The row with its job; the caller enqueues the job after the commit.

    Raises
    ------
    StageExistsError
        The latest job of that name is queued, running or has succeeded.
    """
    latest = session.scalars(_latest(surgery.id, new.name).options(joinedload(Stage.job))).first()
    if latest is not None and latest.job.state not in _REPLACEABLE:
        raise StageExistsError(
            f"this surgery has a stage of that name already and its job is {latest.job.state.value};"
            " choose another name, or cancel a job that has not ended"
        )
    stage = Stage(
        id=str(uuid4()),
        surgery=surgery,
        name=new.name,
        take=1 if latest is None else latest.take + 1,
        calibration=calibration,
        left=images.add(session, new.left, now),
        right=images.add(session, new.right, now),
        captured_at=new.captured_at,
        created_at=now,
        measurement=None,
    )
    session.add(stage)
    job = jobs.add(session, STAGE_JOB, stage.id, now, {"surgery_id": surgery.id})
    set_committed_value(stage, "job", job)
    events.append(session, now, actor, events.Action.STAGE_SUBMITTED, stage.id, surgery.id)
    return stage


def get(session: Session, surgery_id: str, name: str) -> Stage:
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
    Stage
        The row.

    Raises
    ------
    NotFoundError
        There is no such surgery or stage.
    """
    stage = session.scalars(_latest(surgery_id, name).options(*_WHOLE)).first()
    if stage is None:
        if session.get(Surgery, surgery_id) is None:
            raise NotFoundError("surgery")
        raise NotFoundError("stage")
    return stage


def listed(session: Session, surgery_id: str, limit: int, offset: int) -> Page[Stage]:
    """Return a page of a surgery's stages, every take, oldest first.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.
    limit
        Largest number of stages.
    offset
        Number of stages before the page.

    Returns
    -------
    Page of Stage
        The rows with images, job and measurement.
    """
    query = select(Stage).where(Stage.surgery_id == surgery_id).order_by(Stage.created_at, Stage.id)
    return page_of(session, query.options(*_WHOLE), limit, offset)


@dataclass(frozen=True)
class EarlierStage:
    """A stage of the surgery that was submitted before the one in work.

    Attributes
    ----------
    name
        Name of the stage.
    captured_at
        When it was taken, None when unknown.
    sha256
        SHA-256 of its image files, hexadecimal, by side.
    content
        The files by side; empty for a stage whose files are not loaded.
    """

    name: str
    captured_at: datetime | None
    sha256: Mapping[str, str]
    content: Mapping[str, bytes]


@dataclass(frozen=True)
class StageWork:
    """What a worker needs to measure a stage.

    Attributes
    ----------
    left, right
        The image files.
    sha256
        Their SHA-256, hexadecimal, by side.
    rig
        The rig JSON.
    captured_at
        When the stage was taken, None when unknown.
    calibrated_at, calibration_created_at
        When the rig was calibrated, None when unknown, and when the calibration was stored.
    calibration_age
        Age of the calibration when the stage was taken.
    earlier
        Stages of other names that were submitted before, in that order, whatever has become of their jobs.
    vertebrae
        Labels in order of increasing coordinate along the spine axis.
    spine_axis
        x, y or auto.
    extra_levels
        Vertebrae that this spine has in addition to the usual ones.
    """

    left: bytes
    right: bytes
    sha256: Mapping[str, str]
    rig: Document
    captured_at: datetime | None
    calibrated_at: datetime | None
    calibration_created_at: datetime
    calibration_age: timedelta
    earlier: tuple[EarlierStage, ...]
    vertebrae: tuple[str, ...]
    spine_axis: str
    extra_levels: tuple[str, ...]


def work(session: Session, stage_id: str, max_loaded: int = 0) -> StageWork:
    """Return what a worker needs to measure a stage.

    Parameters
    ----------
    session
        Session that reads.
    stage_id
        Identifier of the stage.
    max_loaded
        Number of the latest earlier stages whose files are loaded too.

    Returns
    -------
    StageWork
        Images, rig, labels and earlier stages.
    """
    query = select(Stage).where(Stage.id == stage_id)
    stage = session.scalars(query.options(joinedload(Stage.surgery), joinedload(Stage.calibration))).one()
    return StageWork(
        left=images.content(session, stage.left_sha256),
        right=images.content(session, stage.right_sha256),
        sha256=_sha256(stage),
        rig=stage.calibration.rig,
        captured_at=stage.captured_at,
        calibrated_at=stage.calibration.calibrated_at,
        calibration_created_at=stage.calibration.created_at,
        calibration_age=calibrations.age(stage.calibration, stage),
        earlier=_earlier(session, stage, max_loaded),
        vertebrae=tuple(stage.surgery.vertebrae),
        spine_axis=stage.surgery.spine_axis,
        extra_levels=tuple(stage.surgery.extra_levels),
    )


def _earlier(session: Session, stage: Stage, max_loaded: int) -> tuple[EarlierStage, ...]:
    """Return the stages submitted before a stage; takes of its own name show the same moment."""
    before = or_(
        Stage.created_at < stage.created_at, and_(Stage.created_at == stage.created_at, Stage.id < stage.id)
    )
    query = select(Stage).where(Stage.surgery_id == stage.surgery_id, Stage.name != stage.name, before)
    rows = session.scalars(query.order_by(Stage.created_at, Stage.id)).all()
    loaded = rows[max(len(rows) - max_loaded, 0) :]
    return tuple(
        EarlierStage(
            name=row.name,
            captured_at=row.captured_at,
            sha256=_sha256(row),
            content={s: images.content(session, h) for s, h in _sha256(row).items()} if row in loaded else {},
        )
        for row in rows
    )


def _sha256(stage: Stage) -> dict[str, str]:
    return {"left": stage.left_sha256, "right": stage.right_sha256}


def _latest(surgery_id: str, name: str) -> Select[Stage]:
    takes = select(Stage).where(Stage.surgery_id == surgery_id, Stage.name == name)
    return takes.order_by(Stage.take.desc()).limit(1)


_WHOLE = (
    joinedload(Stage.job),
    joinedload(Stage.calibration),
    joinedload(Stage.left),
    joinedload(Stage.right),
    joinedload(Stage.measurement).options(selectinload(Measurement.features)),
)
