"""Stages in the database: submitting a stereo pair, and what a worker needs to measure it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, timedelta
from uuid import uuid4

from pydantic import TypeAdapter
from sqlalchemy import Select, and_, or_, select
from sqlalchemy.orm import Session, aliased, joinedload, selectinload
from sqlalchemy.orm.attributes import set_committed_value

import contract.revision
import contract.triad
from contract.event import Actor
from contract.job import FINAL_STATES, JobState
from contract.stage import StageResult
from spinewatch.triads.pose import Pose
from store import calibrations, events, images, jobs, results
from store.errors import (
    ImageDamagedError,
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
    Document,
    FurtherPair,
    Image,
    Job,
    Measurement,
    Stage,
    Surgery,
    Triad,
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
    stored = [_sha256(latest), *map(_sha256, latest.further_pairs)]
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
    pairs = [_sha256(stage), *map(_sha256, stage.further_pairs)]
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
class PairWork:
    """A stereo pair of a burst in work.

    Attributes
    ----------
    left, right
        The image files.
    left_exposed_at, right_exposed_at
        When each was exposed, None when unknown.
    """

    left: bytes
    right: bytes
    left_exposed_at: datetime | None = None
    right_exposed_at: datetime | None = None


@dataclass(frozen=True)
class LabelledStage:
    """An earlier stage whose result has the poses of all labels.

    Attributes
    ----------
    name, take
        Name and take of the stage.
    poses
        Poses by label.
    """

    name: str
    take: int
    poses: Mapping[str, Pose]


@dataclass(frozen=True)
class RevisionWork:
    """What is changed of an earlier take of a stage.

    Attributes
    ----------
    changes
        What was asked for.
    revised
        The result of the take.
    """

    changes: contract.revision.NewRevision
    revised: StageResult


@dataclass(frozen=True)
class StageWork:
    """What a worker needs to measure a stage.

    Attributes
    ----------
    left, right
        The image files of the pair, or of the first pair of a burst.
    sha256
        Their SHA-256, hexadecimal, by side.
    rig
        The rig JSON.
    captured_at
        When the stage was taken, or its left image exposed, None when unknown.
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
    name, take
        Name and take of the stage.
    reference_vertebra
        The vertebra in whose frame motion is given.
    left_exposed_at, right_exposed_at
        When each image was exposed, None when unknown.
    further
        The other pairs of a burst.
    labelled
        The latest of the earlier stages whose result has the poses of all labels; None if there is none, or if
        ``unended_job`` has to end first.
    unended_job
        Job of the latest of the earlier stages that may yet be ``labelled``; None if that is decided.
    revision
        What is changed of an earlier take of the stage; None for a take with images of its own.
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
    name: str = ""
    take: int = 1
    reference_vertebra: str = ""
    left_exposed_at: datetime | None = None
    right_exposed_at: datetime | None = None
    further: tuple[PairWork, ...] = ()
    labelled: LabelledStage | None = None
    unended_job: str | None = None
    revision: RevisionWork | None = None

    @property
    def pairs(self) -> tuple[PairWork, ...]:
        """All pairs, in the order in which they were taken."""
        first = PairWork(self.left, self.right, self.left_exposed_at, self.right_exposed_at)
        return (first, *self.further)


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
    whole = joinedload(Stage.surgery), joinedload(Stage.calibration), selectinload(Stage.further_pairs)
    stage = session.scalars(query.options(*whole)).one()
    labelled, unended_job = _labelled(session, stage)
    return StageWork(
        left=images.content(session, stage.left_sha256),
        right=images.content(session, stage.right_sha256),
        sha256=_sha256(stage),
        rig=stage.calibration.rig,
        captured_at=stage.captured_at or stage.left_exposed_at,
        calibrated_at=stage.calibration.calibrated_at,
        calibration_created_at=stage.calibration.created_at,
        calibration_age=calibrations.age(stage.calibration, stage),
        earlier=_earlier(session, stage, max_loaded),
        vertebrae=tuple(stage.surgery.vertebrae),
        spine_axis=stage.surgery.spine_axis,
        extra_levels=tuple(stage.surgery.extra_levels),
        name=stage.name,
        take=stage.take,
        reference_vertebra=stage.surgery.reference_vertebra,
        left_exposed_at=stage.left_exposed_at,
        right_exposed_at=stage.right_exposed_at,
        further=tuple(
            PairWork(
                images.content(session, pair.left_sha256),
                images.content(session, pair.right_sha256),
                pair.left_exposed_at,
                pair.right_exposed_at,
            )
            for pair in stage.further_pairs
        ),
        labelled=labelled,
        unended_job=unended_job,
        revision=_revision(session, stage),
    )


def _revision(session: Session, stage: Stage) -> RevisionWork | None:
    if stage.revised_take is None:
        return None
    query = select(Stage.id).where(
        Stage.surgery_id == stage.surgery_id, Stage.name == stage.name, Stage.take == stage.revised_take
    )
    changes = TypeAdapter[contract.revision.NewRevision](contract.revision.NewRevision).validate_python(
        stage.changes
    )
    return RevisionWork(changes, results.whole(session, session.scalars(query).one()))


def _earlier(session: Session, stage: Stage, max_loaded: int) -> tuple[EarlierStage, ...]:
    """Return the stages submitted before a stage; takes of its own name show the same moment."""
    taken = _before(stage).where(Stage.revised_take.is_(None))  # a revision has the images of its take
    rows = session.scalars(taken.order_by(Stage.created_at, Stage.id)).all()
    loaded = rows[max(len(rows) - max_loaded, 0) :]
    return tuple(
        EarlierStage(
            name=row.name,
            captured_at=row.captured_at or row.left_exposed_at,
            sha256=_sha256(row),
            content=_whole(session, row) if row in loaded else {},
        )
        for row in rows
    )


def _whole(session: Session, stage: Stage) -> dict[str, bytes]:
    """Return the images of an earlier stage that are not damaged; serving a damaged one names the damage."""
    found = {}
    for side, sha256 in _sha256(stage).items():
        with suppress(ImageDamagedError):
            found[side] = images.content(session, sha256)
    return found


def _labelled(session: Session, stage: Stage) -> tuple[LabelledStage | None, str | None]:
    """Return the latest stage before a stage whose result has the poses of all labels, or the job to wait for.

    A stage whose job failed or was cancelled is passed over. One whose job has not ended may have all poses, so that a
    stage before it must not be taken: the answer would depend on which job ends first.
    """
    labels = set(stage.surgery.vertebrae)
    order = (
        Stage.created_at.desc(),
        Stage.take.desc(),
        Stage.id.desc(),
    )  # revisions have the time of their take
    query = _before(stage).order_by(*order).options(joinedload(Stage.job))
    for row in session.scalars(query):
        if row.job.state not in FINAL_STATES:
            return None, row.job.id
        if row.job.state is JobState.SUCCEEDED:
            rows = session.scalars(
                select(Triad.triad).where(Triad.stage_id == row.id).order_by(Triad.position)
            )
            triads = [contract.triad.Triad.model_validate(triad) for triad in rows]
            poses = {triad.label: triad.pose() for triad in triads if triad.label in labels}
            found = {label: pose for label, pose in poses.items() if label is not None and pose is not None}
            if labels == set(found):
                return LabelledStage(row.name, row.take, found), None
    return None, None


def _before(stage: Stage) -> Select[Stage]:
    """Return the query for the stages of other names that were submitted before a stage."""
    before = or_(
        Stage.created_at < stage.created_at, and_(Stage.created_at == stage.created_at, Stage.id < stage.id)
    )
    return select(Stage).where(Stage.surgery_id == stage.surgery_id, Stage.name != stage.name, before)


def _sha256(pair: Stage | FurtherPair) -> dict[str, str]:
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
