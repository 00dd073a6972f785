"""Spines of stages in the database: what is stored, and which result is up to date.

A result counts while its fingerprint is that of its plan as it is, in whatever order jobs end. Whatever changes an
input submits a job in the same transaction.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime

from sqlalchemy import BindParameter, Select, Text, bindparam, cast, func, select
from sqlalchemy.orm import Session

from contract.event import Actor
from contract.spine import StageSpine
from contract.spine_setup import StoredSpineSetup
from contract.summary import SPINE_NOT_COMPUTED
from spinewatch.spine.radiograph_landmarks import RadiographView
from spinewatch.triads.pose import Pose
from store import events, measurements, radiographs, spine_jobs, spine_setups, stages, surgeries
from store.errors import SpineNotAvailableError, SpineNotReadyError
from store.spine_plans import StagePlan, plans
from store.tables.spines import Spine
from store.tables.stages import Stage
from store.tables.surgeries import Surgery


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
        Every measured stage, in the order of `stages.IN_ORDER`.
    outdated
        Identifiers of the stages whose spine is missing or made from other inputs or by another version.
    poses
        Poses of the labelled triads by name of the stage, object space of each stage; all stages in that order,
        empty for one without a measurement.
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
    job_id = spine_jobs.submit(session, surgery_id, now) if stale else None
    return () if job_id is None else (job_id,)


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
            f"{SPINE_NOT_COMPUTED}: its job is {spine_jobs.latest_state(session, surgery_id)}; ask again later"
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
    """Return name and identifier of the take of each stage whose results count, in the order of `IN_ORDER`.

    Of a stage without any it is the latest take.
    """
    measured = Stage.id.in_(stages.counting(surgery_id))
    query = select(Stage.name, Stage.id, Stage.take, measured.label("measured"))
    query = query.where(Stage.surgery_id == surgery_id)
    rows = session.execute(query.order_by(*stages.IN_ORDER)).all()
    shown = {row.name: row.id for row in sorted(rows, key=lambda row: (row.measured, row.take))}
    return [(row.name, row.id) for row in rows if shown[row.name] == row.id]


def _latest_rows(session: Session, surgery_id: str) -> Sequence[Spine]:
    return session.scalars(select(Spine).where(Spine.id.in_(_latest_ids(surgery_id)))).all()


def _latest_ids(surgery_id: str | BindParameter[str]) -> Select[int]:
    return select(func.max(Spine.id)).where(Spine.surgery_id == surgery_id).group_by(Spine.stage_id)


_STORED = select(Spine.stage_id, Spine.fingerprint, cast(Spine.document, Text), Spine.reason).where(
    Spine.id.in_(_latest_ids(bindparam("surgery_id")))
)
