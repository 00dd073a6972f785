"""All stages of a surgery in a few queries, whatever their number: triads and spines as stored JSON text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import Text, and_, bindparam, cast, select
from sqlalchemy.orm import Session, aliased, load_only

from contract.job import JobState
from contract.spine_setup import StoredSpineSetup
from store import spine_setups, spines, surgeries
from store.spines import StoredSpine
from store.tables.base import Document
from store.tables.images import Image
from store.tables.jobs import STAGE_JOB, Job
from store.tables.measurements import Measurement, Triad
from store.tables.stages import Stage
from store.tables.surgeries import Surgery


@dataclass(frozen=True)
class StageRow:
    """The take of a stage whose results count: the latest one that was measured, or else the latest.

    Attributes
    ----------
    stage
        The row, with what a summary shows of it.
    state
        State of the job that measures it.
    left, right
        Rows of the images, without their content.
    flags
        Doubts about the triads (``contract.flag.Flag``); None before its job has succeeded.
    version
        Version of Spinewatch that measured it; None before its job has succeeded.
    triads
        Its triads (``contract.triad.Triad``) as JSON text; None before its job has succeeded.
    spine
        Its spine; None while none is computed from the inputs as they are.
    """

    stage: Stage
    state: JobState
    left: Image
    right: Image
    flags: Sequence[Document] | None
    version: str | None
    triads: Sequence[str] | None
    spine: StoredSpine | None


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
        The take of each stage whose results count, oldest first.
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
    surgery = surgeries.get(session, surgery_id)
    setup = spine_setups.find(session, surgery_id)
    takes = session.execute(_TAKES, {"surgery_id": surgery_id}).all()
    measured = frozenset(stage.id for stage, *_, version in takes if version is not None)
    in_order = sorted((row[0] for row in takes), key=lambda stage: (stage.id in measured, stage.take))
    shown = {stage.name: stage.id for stage in in_order}
    reference = surgery.reference_vertebra if setup is None else setup.setup.reference_vertebra
    triads, posed = _triads(session, surgery_id, reference or surgery.reference_vertebra)
    found: Mapping[str, StoredSpine | None] = {}
    if setup is not None:
        counting = [
            (stage, stage.id in posed)
            for stage, *_ in takes
            if stage.id in measured and shown[stage.name] == stage.id
        ]
        found = spines.stored(session, surgery_id, spines.plans_of(setup, counting))
    rows = [
        StageRow(
            stage=stage,
            state=state,
            left=left,
            right=right,
            flags=flags,
            version=version,
            triads=triads.get(stage.id, []) if stage.id in measured else None,
            spine=found.get(stage.id),
        )
        for stage, state, left, right, flags, version in takes
        if shown[stage.name] == stage.id
    ]
    return SummaryRows(surgery, setup, rows)


def _triads(
    session: Session, surgery_id: str, vertebra: str
) -> tuple[Mapping[str, Sequence[str]], frozenset[str]]:
    """Return the triads by take, and the takes that have a pose of the triad of a vertebra."""
    found: dict[str, list[str]] = {}
    posed = set()
    for stage_id, triad, is_posed in session.execute(
        _TRIADS, {"surgery_id": surgery_id, "vertebra": vertebra}
    ):
        found.setdefault(stage_id, []).append(triad)
        if is_posed:
            posed.add(stage_id)
    return found, frozenset(posed)


_LEFT, _RIGHT = aliased(Image), aliased(Image)
_SHOWN = (Stage.name, Stage.take, Stage.calibration_id, Stage.captured_at, Stage.created_at)
_TAKES = (  # outer joins, so that SQLite begins with the stages
    select(
        Stage,
        Job.state,
        _LEFT,
        _RIGHT,
        Measurement.result["flags"],
        Measurement.result["version"].as_string(),
    )
    .outerjoin(Job, and_(Job.subject_id == Stage.id, Job.kind == STAGE_JOB))
    .outerjoin(_LEFT, _LEFT.sha256 == Stage.left_sha256)
    .outerjoin(_RIGHT, _RIGHT.sha256 == Stage.right_sha256)
    .outerjoin(Measurement, Measurement.stage_id == Stage.id)
    .where(Stage.surgery_id == bindparam("surgery_id"))
    .order_by(Stage.created_at, Stage.id)
    .options(load_only(*_SHOWN))
)
_TRIADS = (
    select(Triad.stage_id, cast(Triad.triad, Text), spines.is_posed(bindparam("vertebra")))
    .join(Stage, Stage.id == Triad.stage_id)
    .where(Stage.surgery_id == bindparam("surgery_id"))
    .order_by(Triad.stage_id, Triad.position)
)
