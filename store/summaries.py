"""All stages of a surgery in a few queries, whatever their number: triads and spines as stored JSON text."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from sqlalchemy import Text, bindparam, cast, select
from sqlalchemy.orm import Session, joinedload

from contract.spine_setup import StoredSpineSetup
from store import spine_setups, spines, surgeries
from store.spines import StoredSpine
from store.tables.measurements import Measurement, Triad
from store.tables.stages import Stage
from store.tables.surgeries import Surgery


@dataclass(frozen=True)
class StageRow:
    """The take of a stage whose results count: the latest one that was measured, or else the latest.

    Attributes
    ----------
    stage
        The row with job, images and measurement.
    triads
        Its triads (``contract.triad.Triad``) as JSON text; None before its job has succeeded.
    spine
        Its spine; None while none is computed from the inputs as they are.
    """

    stage: Stage
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
    takes = session.scalars(_TAKES, {"surgery_id": surgery_id}).all()
    measured = frozenset(stage.id for stage in takes if stage.measurement is not None)
    shown = {stage.name: stage.id for stage in sorted(takes, key=lambda row: (row.id in measured, row.take))}
    triads = _triads(session, surgery_id)
    found: Mapping[str, StoredSpine | None] = {}
    if setup is not None:
        posed = _posed(session, surgery_id, setup.setup.reference_vertebra or surgery.reference_vertebra)
        counting = [
            (take, take.id in posed) for take in takes if take.id in measured and shown[take.name] == take.id
        ]
        found = spines.stored(session, surgery_id, spines.plans_of(setup, counting))
    rows = [
        StageRow(
            stage=stage,
            triads=None if stage.measurement is None else triads.get(stage.id, []),
            spine=found.get(stage.id),
        )
        for stage in takes
        if shown[stage.name] == stage.id
    ]
    return SummaryRows(surgery, setup, rows)


def _triads(session: Session, surgery_id: str) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for stage_id, triad in session.execute(_TRIADS, {"surgery_id": surgery_id}):
        found.setdefault(stage_id, []).append(triad)
    return found


def _posed(session: Session, surgery_id: str, vertebra: str) -> frozenset[str]:
    """Return the takes with a pose of a triad."""
    query = select(Triad.stage_id).join(Stage, Stage.id == Triad.stage_id)
    return frozenset(session.scalars(query.where(Stage.surgery_id == surgery_id, spines.is_posed(vertebra))))


_TAKES = (
    select(Stage)
    .where(Stage.surgery_id == bindparam("surgery_id"))
    .order_by(Stage.created_at, Stage.id)
    .options(
        joinedload(Stage.job),
        joinedload(Stage.left),
        joinedload(Stage.right),
        joinedload(Stage.measurement).load_only(Measurement.result),
    )
)
_TRIADS = (
    select(Triad.stage_id, cast(Triad.triad, Text))
    .join(Stage, Stage.id == Triad.stage_id)
    .where(Stage.surgery_id == bindparam("surgery_id"))
    .order_by(Triad.stage_id, Triad.position)
)
