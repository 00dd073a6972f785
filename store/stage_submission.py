"""Submission of stages to the database: stereo pairs, bursts, retakes and revisions, each with its job."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from uuid import uuid4

from sqlalchemy import Row, and_, bindparam, func, select
from sqlalchemy.orm import Session
from sqlalchemy.orm.attributes import set_committed_value

import contract.measuring
import contract.revision
from contract.event import Actor
from contract.job import FINAL_STATES, JobState
from store import events, images, jobs, stages
from store.errors import (
    StageExistsError,
    StageNameSimilarError,
    StageNotMeasuredError,
    TakeSupersededError,
)
from store.images import NewImage
from store.stages import measuring_of, sha256_by_side
from store.tables.calibrations import Calibration
from store.tables.jobs import STAGE_JOB, Job
from store.tables.stages import FurtherPair, Stage
from store.tables.surgeries import Surgery

_OWN_CHOICE = contract.measuring.Measuring()
"""Nothing is stated: the workers choose."""

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
    measuring
        What is known of the pairs, and how they are measured.
    """

    name: str
    left: NewImage
    right: NewImage
    captured_at: datetime | None
    left_exposed_at: datetime | None = None
    right_exposed_at: datetime | None = None
    further: Sequence[NewPair] = ()
    measuring: contract.measuring.Measuring = _OWN_CHOICE

    @property
    def pairs(self) -> Sequence[NewPair]:
        """All pairs, in the order in which they were taken."""
        first = NewPair(self.left, self.right, self.left_exposed_at, self.right_exposed_at)
        return (first, *self.further)


def find_same(session: Session, surgery: Surgery, calibration: Calibration, new: NewStage) -> Stage | None:
    """Return the latest take of a name if it has the same images in the same order, calibration, times and measuring.

    A time that is not sent is no other time.

    Parameters
    ----------
    session
        Session that reads.
    surgery
        The surgery.
    calibration
        The calibration that the images were taken with.
    new
        The stereo pair, or the burst, and how it is measured.

    Returns
    -------
    Stage or None
        The take, with images, job and measurement; None when it is another one, or its job failed or was cancelled.
    """
    latest = _latest(session, surgery.id, new.name)
    if latest is None or latest.state in _REPLACEABLE or latest.calibration_id != calibration.id:
        return None
    taken = stages.get(session, surgery.id, new.name, latest.take)
    stored: list[Stage | FurtherPair] = [taken, *_further_pairs(session, taken)]
    sent = new.pairs
    same = (
        len(stored) == len(sent)
        and all(_is_same(*pairs) for pairs in zip(sent, stored, strict=True))
        and new.captured_at in {None, taken.captured_at}
        and measuring_of(session, taken) == new.measuring
    )
    return taken if same else None


def _is_same(sent: NewPair, stored: Stage | FurtherPair) -> bool:
    """Return whether a pair has the images of a stored one, and no time that differs from its own."""
    return (
        sha256_by_side(stored) == {"left": sent.left.sha256, "right": sent.right.sha256}
        and sent.left_exposed_at in {None, stored.left_exposed_at}
        and sent.right_exposed_at in {None, stored.right_exposed_at}
    )


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
    succeeded. Nothing is overwritten, and the stage keeps its place among the stages of the surgery.

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
    StageNameSimilarError
        The name is new, and differs from that of another stage in upper and lower case only.
    """
    latest = _latest(session, surgery.id, new.name)
    if latest is None:
        _require_other_name(session, surgery.id, new.name)
    else:
        _require_replaceable(latest.state, latest.id, retake=retake)
    rows = iter(
        images.add_all(session, [image for pair in new.pairs for image in (pair.left, pair.right)], now)
    )
    number = 1 + (session.scalar(_LAST_NUMBER, {"surgery_id": surgery.id}) or 0)
    stage = Stage(
        id=str(uuid4()),
        surgery=surgery,
        name=new.name,
        take=1 if latest is None else latest.take + 1,
        number=number,
        place=number if latest is None else latest.place,
        calibration=calibration,
        left=next(rows),
        right=next(rows),
        captured_at=new.captured_at,
        left_exposed_at=new.left_exposed_at,
        right_exposed_at=new.right_exposed_at,
        created_at=now,
        changes=None if new.measuring == _OWN_CHOICE else new.measuring.model_dump(mode="json"),
        measurement=None,
        further_pairs=[
            FurtherPair(
                position=position,
                left=next(rows),
                right=next(rows),
                left_exposed_at=pair.left_exposed_at,
                right_exposed_at=pair.right_exposed_at,
            )
            for position, pair in enumerate(new.further, start=1)
        ],
    )
    _add(session, stage, surgery.id, now)
    events.append(session, now, actor, events.Action.STAGE_SUBMITTED, stage.id, surgery.id)
    return stage


def _add(session: Session, stage: Stage, surgery_id: str, now: datetime) -> None:
    """Add a take and its queued job."""
    session.add(stage)
    job = jobs.add(session, STAGE_JOB, stage.id, now, {"surgery_id": surgery_id})
    session.flush()
    set_committed_value(stage, "job", job)
    set_committed_value(stage, "pair_count", 1 + len(stage.further_pairs))


def _latest(session: Session, surgery_id: str, name: str) -> Row[str, int, int, str, JobState] | None:
    """Return job, take, place, calibration and state of the job of the latest take of a name."""
    return session.execute(_LATEST, {"surgery_id": surgery_id, "name": name}).one_or_none()


def _require_other_name(session: Session, surgery_id: str, name: str) -> None:
    """Raise ``StageNameSimilarError`` for PRE beside pre: it would be another stage, and its motion would be lost."""
    for other in session.scalars(_NAMES, {"surgery_id": surgery_id}):
        if other.casefold() == name.casefold():
            raise StageNameSimilarError(
                f"this surgery has a stage {other}, from which {name} differs in upper and lower case only; send the"
                f" stage as {other}, with retake=true if it is taken again, or choose another name"
            )


def _further_pairs(session: Session, stage: Stage) -> Sequence[FurtherPair]:
    if stage.pair_count == 1:
        return ()
    query = select(FurtherPair).where(FurtherPair.stage_id == stage.id)
    return session.scalars(query.order_by(FurtherPair.position)).all()


def _require_replaceable(state: JobState, job_id: str, *, retake: bool) -> None:
    """Raise ``StageExistsError`` unless a take may follow the latest one, whose job this is."""
    if state in _REPLACEABLE or (state is JobState.SUCCEEDED and retake):
        return
    advice = "wait for its job, or cancel it"
    if state is JobState.SUCCEEDED:
        advice = "choose another name, or send retake=true to take the stage again"
    raise StageExistsError(
        f"this surgery has a stage of that name already and its job is {state.value}; {advice}", job_id
    )


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
    latest = stages.get(session, surgery_id, name)
    if latest.job.state not in FINAL_STATES:
        _require_replaceable(latest.job.state, latest.job.id, retake=True)
    revised = stages.measured(session, surgery_id, name)
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
        number=revised.number,
        place=revised.place,
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
            for pair in _further_pairs(session, revised)
        ],
    )
    _add(session, stage, surgery_id, now)
    events.append(session, now, actor, events.Action.STAGE_REVISED, stage.id, surgery_id)
    return stage


_LATEST = (  # an outer join, so that SQLite begins with the stage
    select(Job.id, Stage.take, Stage.place, Stage.calibration_id, Job.state)
    .select_from(Stage)
    .outerjoin(Job, and_(Job.subject_id == Stage.id, Job.kind == STAGE_JOB))
    .where(Stage.surgery_id == bindparam("surgery_id"), Stage.name == bindparam("name"))
    .order_by(Stage.take.desc())
    .limit(1)
)
_NAMES = select(Stage.name).where(Stage.surgery_id == bindparam("surgery_id")).distinct()
_LAST_NUMBER = select(func.max(Stage.number)).where(Stage.surgery_id == bindparam("surgery_id"))
