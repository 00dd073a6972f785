"""Spines of stages in the database: when a job computes them, from which inputs, and which result is up to date.

The spine of a stage depends on the setup, on the re-clamped markers, and on the measurements of the stage, of the
baseline and of the stage before; the fingerprint names them all. A result counts while its fingerprint is that of the
inputs as they are, in whatever order jobs end. Whatever changes an input submits a job in the same transaction.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Protocol

from sqlalchemy import BindParameter, ColumnElement, Select, Text, and_, bindparam, cast, func, select
from sqlalchemy.orm import Session

from contract.event import Actor
from contract.job import JobState
from contract.spine import StageSpine
from contract.spine_setup import StoredSpineSetup
from contract.stage_reference import StageReference
from contract.summary import SPINE_NOT_COMPUTED
from spinewatch.spine.radiograph_landmarks import RadiographView
from spinewatch.spine.stage_order import comparisons
from spinewatch.triads.pose import Pose
from store import events, jobs, measurements, radiographs, spine_setups, stages, surgeries
from store.errors import SpineNotAvailableError, SpineNotReadyError
from store.tables.jobs import SPINE_JOB, Job
from store.tables.measurements import Triad
from store.tables.spines import Spine, SpineSetup
from store.tables.stages import Stage
from store.tables.surgeries import Surgery


class Take(Protocol):
    """What of a take the spine of its stage depends on."""

    @property
    def id(self) -> str:
        """Identifier of the take."""

    @property
    def name(self) -> str:
        """Name of the stage."""

    @property
    def take(self) -> int:
        """Number of the take."""

    @property
    def calibration_id(self) -> str:
        """Identifier of the calibration."""


@dataclass(frozen=True)
class StagePlan:
    """What the spine of a measured stage is computed from.

    Attributes
    ----------
    stage_id
        Identifier of the stage.
    reference
        Name, take and calibration of the stage.
    baseline
        Name of the baseline stage, None while no stage has a pose of the reference triad.
    previous
        Name of the stage before, of those that have a pose of the reference triad; None for the first one.
    fingerprint
        SHA-256 of the inputs, hexadecimal.
    """

    stage_id: str
    reference: StageReference
    baseline: str | None
    previous: str | None
    fingerprint: str


@dataclass(frozen=True)
class SpineWork:
    """What a worker needs to compute the spines of a surgery.

    Attributes
    ----------
    vertebrae
        Vertebrae with a marker, as the surgery names them.
    reference_vertebra
        Vertebra of the surgery's reference triad.
    extra_levels
        Vertebrae that this spine has in addition to the usual ones.
    setup
        The setup; None when the surgery has none.
    plans
        Every measured stage, in order of submission.
    outdated
        Identifiers of the stages whose spine is missing or made from other inputs or by another version.
    poses
        Poses of the labelled triads by name of the stage, object space of each stage; all stages in order of
        submission, empty for one without a measurement.
    radiographs
        Views of the surgery's radiographs by identifier.
    """

    vertebrae: tuple[str, ...]
    reference_vertebra: str
    extra_levels: tuple[str, ...]
    setup: StoredSpineSetup | None
    plans: tuple[StagePlan, ...]
    outdated: frozenset[str]
    poses: Mapping[str, Mapping[str, Pose]]
    radiographs: Mapping[str, RadiographView]


@dataclass(frozen=True)
class ComputedSpine:
    """The spine of a stage, or the reason why there is none.

    Attributes
    ----------
    plan
        What it was computed from.
    spine
        The spine, or None.
    reason
        Why there is none, or None.
    """

    plan: StagePlan
    spine: StageSpine | None
    reason: str | None


@dataclass(frozen=True)
class StoredSpine:
    """The stored spine of a stage.

    Attributes
    ----------
    json
        The document (``contract.spine.StageSpine``) as JSON text; None when there is none.
    reason
        Why there is none, or None.
    """

    json: str | None
    reason: str | None


def submit(session: Session, surgery_id: str, now: datetime) -> str | None:
    """Add a job that computes the spines of a surgery, in the transaction that changes one of its inputs.

    Parameters
    ----------
    session
        Session that writes.
    surgery_id
        Identifier of the surgery.
    now
        Time of the change.

    Returns
    -------
    str or None
        Identifier of the job, which the caller enqueues after the commit. None when the surgery has no setup, or has a
        queued job, which will see the change.
    """
    if (
        session.scalars(select(SpineSetup.revision).where(SpineSetup.surgery_id == surgery_id)).first()
        is None
    ):
        return None
    if queued(session, surgery_id) is not None:
        return None
    return jobs.add(session, SPINE_JOB, surgery_id, now, {"surgery_id": surgery_id}).id


def resubmit(session: Session, surgery_id: str, now: datetime) -> str:
    """Return the job that computes the spines of a surgery, a new one unless one is queued.

    Parameters
    ----------
    session
        Session that writes.
    surgery_id
        Identifier of the surgery.
    now
        Time of the request.

    Returns
    -------
    str
        Identifier of the job, which the caller enqueues after the commit.

    Raises
    ------
    NotFoundError
        There is no such surgery.
    SetupMissingError
        The surgery has no setup.
    """
    spine_setups.get(session, surgery_id)
    waiting = queued(session, surgery_id)
    if waiting is not None:
        return waiting
    return jobs.add(session, SPINE_JOB, surgery_id, now, {"surgery_id": surgery_id}).id


def queued(session: Session, surgery_id: str) -> str | None:
    """Return the queued job that computes the spines of a surgery, and keep workers from claiming it meanwhile.

    Parameters
    ----------
    session
        Session that writes.
    surgery_id
        Identifier of the surgery.

    Returns
    -------
    str or None
        Identifier of the job, None when none is queued.
    """
    query = select(Job.id).where(
        Job.kind == SPINE_JOB, Job.subject_id == surgery_id, Job.state == JobState.QUEUED
    )
    return session.scalars(query.with_for_update()).first()


def work(session: Session, surgery_id: str, version: str | None = None) -> SpineWork:
    """Return what a worker needs to compute the spines of a surgery.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.
    version
        Version of Spinewatch that computes; a spine of another one is out of date. None for any.

    Returns
    -------
    SpineWork
        Setup, stages and poses.
    """
    surgery = surgeries.get(session, surgery_id)
    setup = spine_setups.find(session, surgery_id)
    planned = () if setup is None else plans(session, surgery, setup)
    done = {
        row.stage_id: row.fingerprint
        for row in _latest_rows(session, surgery_id)
        if version in {None, row.version}
    }
    outdated = frozenset(plan.stage_id for plan in planned if done.get(plan.stage_id) != plan.fingerprint)
    return SpineWork(
        vertebrae=tuple(surgery.vertebrae),
        reference_vertebra=surgery.reference_vertebra,
        extra_levels=tuple(surgery.extra_levels),
        setup=setup,
        plans=planned,
        outdated=outdated,
        poses={
            name: measurements.poses(session, stage_id) for name, stage_id in _stage_ids(session, surgery_id)
        },
        radiographs=radiographs.views(session, surgery_id),
    )


def add(
    session: Session,
    surgery_id: str,
    computed: Iterable[ComputedSpine],
    version: str,
    now: datetime,
    actor: Actor,
) -> tuple[str, ...]:
    """Add the spines whose inputs have not changed meanwhile.

    Parameters
    ----------
    session
        Session that writes.
    surgery_id
        Identifier of the surgery.
    computed
        The spines.
    version
        Version of Spinewatch that computed them.
    now
        Time of the result.
    actor
        The worker.

    Returns
    -------
    tuple of str
        Identifier of a job to enqueue, if a spine was made from inputs that have changed.
    """
    # one transaction at a time: a spine of former inputs must not be stored after a newer one
    surgery = session.scalars(select(Surgery).where(Surgery.id == surgery_id).with_for_update()).one()
    setup = spine_setups.find(session, surgery_id)
    current = {} if setup is None else {p.stage_id: p.fingerprint for p in plans(session, surgery, setup)}
    stale = False
    for item in computed:
        plan = item.plan
        if setup is None or current.get(plan.stage_id) != plan.fingerprint:
            stale = True
            continue
        session.add(
            Spine(
                surgery_id=surgery_id,
                stage_id=plan.stage_id,
                setup_revision=setup.revision,
                fingerprint=plan.fingerprint,
                document=None if item.spine is None else item.spine.model_dump(mode="json"),
                reason=item.reason,
                version=version,
                created_at=now,
            )
        )
        events.append(session, now, actor, events.Action.SPINE_COMPUTED, plan.stage_id, surgery_id)
    job_id = submit(session, surgery_id, now) if stale else None
    return () if job_id is None else (job_id,)


def plans(session: Session, surgery: Surgery, setup: StoredSpineSetup) -> tuple[StagePlan, ...]:
    """Return what the spine of each measured stage is computed from.

    Parameters
    ----------
    session
        Session that reads.
    surgery
        The surgery.
    setup
        Its setup.

    Returns
    -------
    tuple of StagePlan
        Measured stages in order of submission. Without a named baseline, the first one with a pose of the reference
        triad is the baseline.
    """
    reference = setup.setup.reference_vertebra or surgery.reference_vertebra
    posed = select(Triad.stage_id).where(Triad.stage_id == Stage.id, is_posed(reference)).exists()
    query = select(Stage, posed).where(Stage.id.in_(stages.counting(surgery.id)))
    rows = session.execute(query.order_by(Stage.created_at, Stage.id))
    return plans_of(setup, [(stage, has) for stage, has in rows])


def is_posed(vertebra: str | BindParameter[str]) -> ColumnElement[bool]:
    """Return the condition for the triad of a vertebra that has a pose.

    Parameters
    ----------
    vertebra
        Label of the triad, or the parameter for it.

    Returns
    -------
    ColumnElement
        The condition on a row of triads.
    """
    return and_(Triad.label == vertebra, Triad.triad["position_mm"].as_string().is_not(None))


def plans_of(setup: StoredSpineSetup, rows: Sequence[tuple[Take, bool]]) -> tuple[StagePlan, ...]:
    """Return what the spine of each measured stage is computed from, as `plans`.

    Parameters
    ----------
    setup
        The setup of the surgery.
    rows
        The take of each measured stage whose results count, in order of submission, and whether it has a pose of the
        reference triad.

    Returns
    -------
    tuple of StagePlan
        In the same order.
    """
    ids = {stage.name: stage.id for stage, _ in rows}
    clamped = [[ids.get(item.before), ids.get(item.after)] for item in setup.rebaselines]
    compared = comparisons([(stage.name, has) for stage, has in rows], setup.setup.baseline)
    planned = []
    for (stage, _), others in zip(rows, compared, strict=True):
        inputs = [
            setup.revision,
            clamped,
            stage.id,
            others.baseline and ids.get(others.baseline),
            others.previous and ids[others.previous],
        ]
        planned.append(
            StagePlan(
                stage_id=stage.id,
                reference=StageReference(
                    name=stage.name, take=stage.take, calibration_id=stage.calibration_id
                ),
                baseline=others.baseline,
                previous=others.previous,
                fingerprint=hashlib.sha256(json.dumps(inputs).encode()).hexdigest(),
            )
        )
    return tuple(planned)


def get(session: Session, surgery_id: str, name: str) -> str:
    """Return the spine of a stage.

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
    str
        The document (``contract.spine.StageSpine``) as JSON text.

    Raises
    ------
    NotFoundError
        There is no such surgery or stage.
    SetupMissingError
        The surgery has no setup.
    StageNotMeasuredError
        The stage's job has not succeeded.
    SpineNotReadyError
        The spine is not computed yet from the inputs as they are.
    SpineNotAvailableError
        The stage has no spine; the message says why.
    """
    stage, _ = measurements.get(session, surgery_id, name)
    setup = spine_setups.get(session, surgery_id)
    found = stored(session, stage.surgery_id, plans(session, surgeries.get(session, surgery_id), setup))[
        stage.id
    ]
    if found is None:
        raise SpineNotReadyError(
            f"{SPINE_NOT_COMPUTED}: its job is {_job_state(session, surgery_id)}; ask again later"
        )
    if found.json is None:
        raise SpineNotAvailableError(str(found.reason))
    return found.json


def stored(session: Session, surgery_id: str, planned: Sequence[StagePlan]) -> dict[str, StoredSpine | None]:
    """Return the spines of measured stages as they are stored.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.
    planned
        The measured stages.

    Returns
    -------
    dict of str to StoredSpine or None
        By identifier of the stage; None where no spine was computed from the inputs as they are.
    """
    stored_rows = session.connection().execute(_STORED, {"surgery_id": surgery_id})
    rows = {row[0]: row[1:] for row in stored_rows}
    found: dict[str, StoredSpine | None] = {}
    for plan in planned:
        fingerprint, text, reason = rows.get(plan.stage_id, (None, None, None))
        current = fingerprint == plan.fingerprint
        found[plan.stage_id] = StoredSpine(text, reason) if current else None
    return found


def _stage_ids(session: Session, surgery_id: str) -> Iterable[tuple[str, str]]:
    """Return name and identifier of the take of each stage whose results count, in order of submission.

    Of a stage without any it is the latest take.
    """
    measured = Stage.id.in_(stages.counting(surgery_id))
    query = select(Stage.name, Stage.id, Stage.take, measured.label("measured"))
    query = query.where(Stage.surgery_id == surgery_id)
    rows = session.execute(query.order_by(Stage.created_at, Stage.id)).all()
    shown = {row.name: row.id for row in sorted(rows, key=lambda row: (row.measured, row.take))}
    return [(row.name, row.id) for row in rows if shown[row.name] == row.id]


def _latest_rows(session: Session, surgery_id: str) -> Sequence[Spine]:
    return session.scalars(select(Spine).where(Spine.id.in_(_latest_ids(surgery_id)))).all()


def _latest_ids(surgery_id: str | BindParameter[str]) -> Select[int]:
    return select(func.max(Spine.id)).where(Spine.surgery_id == surgery_id).group_by(Spine.stage_id)


def _job_state(session: Session, surgery_id: str) -> str:
    query = select(Job.state).where(Job.kind == SPINE_JOB, Job.subject_id == surgery_id)
    state = session.scalars(query.order_by(Job.created_at.desc(), Job.id).limit(1)).first()
    return "not submitted" if state is None else state.value


_STORED = select(Spine.stage_id, Spine.fingerprint, cast(Spine.document, Text), Spine.reason).where(
    Spine.id.in_(_latest_ids(bindparam("surgery_id")))
)
