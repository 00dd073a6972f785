"""All stages of a surgery in a few queries, whatever their number: triads and spines as stored JSON text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from datetime import datetime
from typing import Any

from sqlalchemy import Text, and_, bindparam, cast, select
from sqlalchemy.orm import Session, aliased

from contract.job import JobState
from contract.spine_setup import StoredSpineSetup
from store import retention, spine_plans, spine_setups, spines, stages
from store.errors import NotFoundError
from store.images import StoredImage
from store.spines import StoredSpine
from store.tables.base import Document
from store.tables.images import Image
from store.tables.jobs import STAGE_JOB, Job
from store.tables.measurements import Measurement, Triad
from store.tables.stages import Stage
from store.tables.surgeries import Surgery


@dataclass(frozen=True)
class Take:
    """A take of a stage, with what a summary shows of it.

    Attributes
    ----------
    id
        Identifier of the take.
    name
        Name of the stage.
    take
        Number of the take.
    calibration_id
        Identifier of the calibration.
    captured_at
        Time of capture as sent, None when unknown.
    created_at
        Time of the submission.
    """

    id: str
    name: str
    take: int
    calibration_id: str
    captured_at: datetime | None
    created_at: datetime


@dataclass(frozen=True)
class StageRow:
    """The take of a stage whose results count: the latest one that was measured, or else the latest.

    Attributes
    ----------
    stage
        The take.
    left, right
        Its images.
    state
        State of the job that measures it.
    flags
        Doubts about the triads (``contract.flag.Flag``); None before its job has succeeded.
    version
        Version of Spinewatch that measured it; None before its job has succeeded.
    triads
        Its triads (``contract.triad.Triad``) as JSON text; None before its job has succeeded.
    spine
        Its spine; None while none is computed from the inputs as they are.
    """

    stage: Take
    left: StoredImage
    right: StoredImage
    state: JobState
    flags: Sequence[Document] | None
    version: str | None
    triads: Sequence[str] | None = None
    spine: StoredSpine | None = None


@dataclass(frozen=True)
class SummaryRows:
    """A surgery with all its stages.

    Attributes
    ----------
    surgery
        The surgery.
    setup
        The setup of its spine, None without one.
    stages
        The take of each stage whose results count, in the order of `stages.IN_ORDER`.
    """

    surgery: Surgery
    setup: StoredSpineSetup | None
    stages: Sequence[StageRow]


def get(session: Session, surgery_id: str) -> SummaryRows:
    """Return a surgery with all its stages.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.

    Returns
    -------
    SummaryRows
        The rows.

    Raises
    ------
    NotFoundError
        There is no such surgery.
    """
    retention.require_present(session, surgery_id)
    # rows of the connection: those of the session cost more than the database
    connection = session.connection()
    found = connection.execute(_SURGERY, {"surgery_id": surgery_id}).mappings().one_or_none()
    if found is None:
        raise NotFoundError("surgery")
    surgery = Surgery(**found)
    setup = spine_setups.find(session, surgery_id)
    takes = [_stage_row(row) for row in connection.execute(_TAKES, {"surgery_id": surgery_id})]
    in_order = sorted(takes, key=lambda row: (row.version is not None, row.stage.take))
    counting = {row.stage.name: row.stage.id for row in in_order}
    shown = [row for row in takes if counting[row.stage.name] == row.stage.id]
    reference = surgery.reference_vertebra if setup is None else setup.setup.reference_vertebra
    triads, posed = _triads(session, surgery_id, reference or surgery.reference_vertebra)
    computed: Mapping[str, StoredSpine | None] = {}
    if setup is not None:
        measured = [(row.stage, row.stage.id in posed) for row in shown if row.version is not None]
        first = shown[0].stage.name if shown else None
        computed = spines.stored(session, surgery_id, spine_plans.plans_of(setup, first, measured))
    complete = [
        row
        if row.version is None
        else replace(row, triads=triads.get(row.stage.id, []), spine=computed.get(row.stage.id))
        for row in shown
    ]
    return SummaryRows(surgery, setup, complete)


def _stage_row(row: Sequence[Any]) -> StageRow:
    left = len(_TAKE)
    right = left + len(_IMAGE)
    end = right + len(_IMAGE)
    return StageRow(
        Take(*row[:left]), StoredImage(*row[left:right]), StoredImage(*row[right:end]), *row[end:]
    )


def _triads(
    session: Session, surgery_id: str, vertebra: str
) -> tuple[Mapping[str, Sequence[str]], frozenset[str]]:
    """Return the triads by take, and the takes that have a pose of the triad of a vertebra."""
    found: dict[str, list[str]] = {}
    posed = set()
    for stage_id, triad, is_posed in session.connection().execute(
        _TRIADS, {"surgery_id": surgery_id, "vertebra": vertebra}
    ):
        found.setdefault(stage_id, []).append(triad)
        if is_posed:
            posed.add(stage_id)
    return found, frozenset(posed)


_SURGERY = select(*Surgery.__table__.columns).where(Surgery.id == bindparam("surgery_id"))
_LEFT, _RIGHT = aliased(Image), aliased(Image)
_TAKE = tuple(field.name for field in fields(Take))
_IMAGE = tuple(field.name for field in fields(StoredImage))
_TAKES = (  # outer joins, so that SQLite begins with the stages
    select(
        *(getattr(Stage, name) for name in _TAKE),
        *(getattr(side, name) for side in (_LEFT, _RIGHT) for name in _IMAGE),
        Job.state,
        Measurement.result["flags"],
        Measurement.result["version"].as_string(),
    )
    .outerjoin(Job, and_(Job.subject_id == Stage.id, Job.kind == STAGE_JOB))
    .outerjoin(_LEFT, _LEFT.sha256 == Stage.left_sha256)
    .outerjoin(_RIGHT, _RIGHT.sha256 == Stage.right_sha256)
    .outerjoin(Measurement, Measurement.stage_id == Stage.id)
    .where(Stage.surgery_id == bindparam("surgery_id"))
    .order_by(*stages.IN_ORDER)
)
_TRIADS = (
    select(Triad.stage_id, cast(Triad.triad, Text), spine_plans.is_posed(bindparam("vertebra")))
    .join(Stage, Stage.id == Triad.stage_id)
    .where(Stage.surgery_id == bindparam("surgery_id"))
    .order_by(Triad.stage_id, Triad.position)
)
