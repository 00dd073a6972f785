"""Stages in the record: submitting a stereo pair, and reading what was measured in it."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from uuid import uuid4

import numpy as np
from sqlalchemy import Select, select
from sqlalchemy.orm import Session, joinedload, selectinload, undefer

from spinewatch.triads.pose import Pose
from store import calibrations, events, images, jobs
from store.errors import NotFoundError, StageExistsError, StageNotMeasuredError
from store.images import NewImage
from store.page import Page, page_of
from store.tables import Calibration, Document, FeatureList, JobState, Measurement, Stage, Surgery, Triad

_REPLACEABLE = frozenset({JobState.FAILED, JobState.CANCELLED})


@dataclass(frozen=True)
class NewStage:
    """A stereo pair that was taken at a stage of a surgery."""

    name: str
    left: NewImage
    right: NewImage
    captured_at: datetime | None


def submit(
    session: Session, surgery: Surgery, calibration: Calibration, new: NewStage, now: datetime
) -> Stage:
    """Add a stage with its pictures and its queued job.

    A name in use is the next take when the latest job of that name failed or was cancelled; otherwise raises
    ``StageExistsError``. Nothing is overwritten.
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
        left=images.keep(session, new.left, now),
        right=images.keep(session, new.right, now),
        captured_at=new.captured_at,
        created_at=now,
        measurement=None,
        job=jobs.queued(now),
    )
    session.add(stage)
    events.append(session, now, events.Action.STAGE_SUBMITTED, stage.id, surgery.id)
    return stage


def get(session: Session, surgery_id: str, name: str) -> Stage:
    """Return the latest take of a stage with pictures, job and measurement; raise ``NotFoundError``."""
    stage = session.scalars(_latest(surgery_id, name).options(*_WHOLE)).first()
    if stage is None:
        if session.get(Surgery, surgery_id) is None:
            raise NotFoundError("surgery")
        raise NotFoundError("stage")
    return stage


def listed(session: Session, surgery_id: str, limit: int, offset: int) -> Page[Stage]:
    """Return a page of a surgery's stages, every take, oldest first."""
    query = select(Stage).where(Stage.surgery_id == surgery_id).order_by(Stage.created_at, Stage.id)
    return page_of(session, query.options(*_WHOLE), limit, offset)


def measurement(session: Session, surgery_id: str, name: str) -> tuple[Stage, Measurement]:
    """Return the latest take of a stage and what was measured in it; raise ``StageNotMeasuredError``."""
    stage = get(session, surgery_id, name)
    if stage.measurement is None:
        raise StageNotMeasuredError(
            f"stage {stage.name} has no result: its job is {stage.job.state.value};"
            " wait until the job has succeeded, or take the stage again"
        )
    return stage, stage.measurement


@dataclass(frozen=True)
class StageWork:
    """What a worker needs to measure a stage: both files, the rig JSON, how old it was, the labels in order."""

    left: bytes
    right: bytes
    rig: Document
    calibration_age: timedelta
    vertebrae: tuple[str, ...]
    spine_axis: str


def work(session: Session, stage_id: str) -> StageWork:
    """Return what there is to measure in a stage."""
    query = select(Stage).where(Stage.id == stage_id)
    stage = session.scalars(query.options(joinedload(Stage.surgery), joinedload(Stage.calibration))).one()
    return StageWork(
        left=images.content(session, stage.left_sha256),
        right=images.content(session, stage.right_sha256),
        rig=stage.calibration.rig,
        calibration_age=calibrations.age(stage.calibration, stage),
        vertebrae=tuple(stage.surgery.vertebrae),
        spine_axis=stage.surgery.spine_axis,
    )


def features(session: Session, stage_id: str) -> dict[str, list[dict[str, object]]]:
    """Return the features of both views of a measured stage, by side."""
    query = select(FeatureList).where(FeatureList.stage_id == stage_id).options(undefer(FeatureList.points))
    return {row.side: row.points for row in session.scalars(query)}


def poses(measured: Measurement) -> dict[str, Pose]:
    """Return the poses of the labelled triads, by label, in object space of the stage's calibration."""
    labelled = {triad.label: pose(triad) for triad in measured.triads if triad.label is not None}
    return {label: found for label, found in labelled.items() if found is not None}


def pose(triad: Triad) -> Pose | None:
    """Return the pose in a triad's row, or None for a triad without."""
    if triad.rotation is None:
        return None
    return Pose(
        position_mm=np.array([triad.x_mm, triad.y_mm, triad.z_mm]),
        rotation=np.array(triad.rotation),
        covariance=np.array(triad.covariance),
    )


def _latest(surgery_id: str, name: str) -> Select[Stage]:
    mine = select(Stage).where(Stage.surgery_id == surgery_id, Stage.name == name)
    return mine.order_by(Stage.take.desc()).limit(1)


_WHOLE = (
    joinedload(Stage.job),
    joinedload(Stage.calibration),
    joinedload(Stage.left),
    joinedload(Stage.right),
    joinedload(Stage.measurement).options(
        selectinload(Measurement.features), selectinload(Measurement.triads)
    ),
)
