"""The result of a measured stage put together again from its tables."""

from __future__ import annotations

from sqlalchemy import select
from sqlalchemy.orm import Session, undefer

from contract.stage import StageResult
from store.tables.measurements import Burst, FeatureList, Measurement, Triad


def whole(session: Session, stage_id: str) -> StageResult:
    """Return everything that was measured in a take.

    Parameters
    ----------
    session
        Session that reads.
    stage_id
        Identifier of the take, which has a measurement.

    Returns
    -------
    StageResult
        The result as the worker made it.
    """
    measurement = session.get_one(Measurement, stage_id)
    triads = select(Triad.triad).where(Triad.stage_id == stage_id).order_by(Triad.position)
    lists = select(FeatureList).where(FeatureList.stage_id == stage_id).options(undefer(FeatureList.points))
    burst = session.get(Burst, stage_id)
    return StageResult.model_validate(
        {
            **measurement.result,
            "triads": list(session.scalars(triads)),
            "features": {row.side: row.points for row in session.scalars(lists)},
            "burst": None if burst is None else burst.burst,
        }
    )
