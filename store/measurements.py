"""Results of stages in the database: contract models as JSON, and the poses for motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime

from sqlalchemy import insert, select
from sqlalchemy.orm import Session, undefer

from contract.burst import Burst
from contract.event import Actor
from contract.features import FeaturePair
from contract.pair_result import PairResult
from contract.stage import StageResult
from contract.triad import Triad
from spinewatch.triads.pose import Pose
from store import events, pair_results, stages, tables
from store.errors import StageNotMeasuredError
from store.packed_stage import PackedStage, pack
from store.tables.base import Document
from store.tables.measurements import FeatureList, Measurement
from store.tables.stages import Stage


@dataclass(frozen=True)
class MeasuredStage:
    """What a worker measured in a stage.

    Attributes
    ----------
    result
        The result.
    pairs
        What each pair was measured from, in the order in which they were taken.
    strips
        Strips of the images of the first pair as they are stored, by side; none for a revision.
    """

    result: StageResult
    pairs: Sequence[PairResult] = ()
    strips: Mapping[str, bytes] = field(default_factory=dict)

    def packed(self) -> PackedStage:
        """Return what is stored of it.

        Returns
        -------
        PackedStage
            The rows.
        """
        return pack(self.result, self.pairs, self.strips)


def add(session: Session, stage_id: str, rows: PackedStage, now: datetime, actor: Actor) -> None:
    """Add the result of a stage.

    Parameters
    ----------
    session
        Session that writes.
    stage_id
        Identifier of the stage.
    rows
        What is stored of it.
    now
        Time of the result.
    actor
        The worker.
    """
    connection = session.connection()  # bulk inserts of the session take three times as long
    connection.execute(insert(Measurement), {"stage_id": stage_id, "result": rows.result, "created_at": now})
    features = [
        {"side": side, "count": count, "points": points, "strip": strip}
        for side, count, points, strip in rows.features
    ]
    triads = [
        {"position": position, "label": label, "triad": triad}
        for position, (label, triad) in enumerate(rows.triads)
    ]
    bursts = [] if rows.burst is None else [{"burst": rows.burst}]
    for table, values in (
        (FeatureList, features),
        (tables.measurements.Triad, triads),
        (tables.measurements.Burst, bursts),
    ):
        if values:
            connection.execute(insert(table), [{"stage_id": stage_id, **row} for row in values])
    pair_results.add(session, stage_id, rows.pairs)
    surgery_id = session.scalars(select(Stage.surgery_id).where(Stage.id == stage_id)).one()
    events.append(session, now, actor, events.Action.STAGE_MEASURED, stage_id, surgery_id)


def get(session: Session, surgery_id: str, name: str, take: int | None = None) -> tuple[Stage, Measurement]:
    """Return a take of a stage and its measurement.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.
    name
        Name of the stage.
    take
        Number of the take; None for the latest one that was measured.

    Returns
    -------
    tuple of Stage and Measurement
        The rows.

    Raises
    ------
    NotFoundError
        There is no such surgery, stage or take.
    StageNotMeasuredError
        The stage's job has not succeeded.
    """
    stage = stages.measured(session, surgery_id, name, take)
    if stage.measurement is None:
        raise StageNotMeasuredError(
            f"stage {stage.name} has no result: its job is {stage.job.state.value};"
            " wait until the job has succeeded, or take the stage again"
        )
    return stage, stage.measurement


def own_parameters(session: Session, stage: Stage) -> Document:
    """Return the parameters of a stage before revisions changed any.

    Parameters
    ----------
    session
        Session that reads.
    stage
        A take that was measured.

    Returns
    -------
    dict
        Parameters of the latest take up to this one that was measured and is no revision.
    """
    query = (
        select(Measurement.result)
        .join(Stage, Stage.id == Measurement.stage_id)
        .where(
            Stage.surgery_id == stage.surgery_id,
            Stage.name == stage.name,
            Stage.take <= stage.take,
            Stage.revised_take.is_(None),
        )
        .order_by(Stage.take.desc())
    )
    parameters: Document = session.scalars(query.limit(1)).one()["parameters"]
    return parameters


def triads(session: Session, stage_id: str) -> list[Triad]:
    """Return the triads of a measured stage.

    Parameters
    ----------
    session
        Session that reads.
    stage_id
        Identifier of the stage.

    Returns
    -------
    list of Triad
        In the order of the measurement.
    """
    query = select(tables.measurements.Triad.triad).where(tables.measurements.Triad.stage_id == stage_id)
    return [
        Triad.model_validate(triad)
        for triad in session.scalars(query.order_by(tables.measurements.Triad.position))
    ]


def features(session: Session, stage_id: str) -> FeaturePair:
    """Return the features of a measured stage.

    Parameters
    ----------
    session
        Session that reads.
    stage_id
        Identifier of the stage.

    Returns
    -------
    FeaturePair
        Those of both images.
    """
    query = select(FeatureList).where(FeatureList.stage_id == stage_id).options(undefer(FeatureList.points))
    return FeaturePair.model_validate({row.side: row.points for row in session.scalars(query)})


def burst(session: Session, stage_id: str) -> Burst | None:
    """Return the burst of a measured stage.

    Parameters
    ----------
    session
        Session that reads.
    stage_id
        Identifier of the stage.

    Returns
    -------
    Burst or None
        The burst; None for a stage of a single pair.
    """
    row = session.get(tables.measurements.Burst, stage_id)
    return None if row is None else Burst.model_validate(row.burst)


def poses(session: Session, stage_id: str) -> dict[str, Pose]:
    """Return the poses of the labelled triads of a measured stage.

    Parameters
    ----------
    session
        Session that reads.
    stage_id
        Identifier of the stage.

    Returns
    -------
    dict of str to Pose
        Poses by label, in object space of the stage's calibration; a triad without a pose has none.
    """
    found = ((triad.label, triad.pose()) for triad in triads(session, stage_id))
    return {label: pose for label, pose in found if label is not None and pose is not None}
