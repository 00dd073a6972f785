"""Time that the steps of jobs take, summed over all workers: few rows, however many jobs there were."""

from __future__ import annotations

from collections.abc import Mapping

from sqlalchemy import select
from sqlalchemy.orm import Session

from store.tables import StepTime


def add(session: Session, kind: str, seconds: Mapping[str, float]) -> None:
    """Add the times of a job that succeeded, in the transaction that ends it.

    Parameters
    ----------
    session
        Session that writes.
    kind
        Kind of the job.
    seconds
        Time by step, s.
    """
    for step in sorted(seconds):  # in one order, so that two workers never wait for each other
        row = session.get(StepTime, (kind, step), with_for_update=True)
        if row is None:
            session.add(StepTime(kind=kind, step=step, count=1, seconds=seconds[step]))
        else:
            row.count += 1
            row.seconds += seconds[step]


def listed(session: Session) -> list[StepTime]:
    """Return the sums.

    Parameters
    ----------
    session
        Session that reads.

    Returns
    -------
    list of StepTime
        One row per kind and step.
    """
    return list(session.scalars(select(StepTime).order_by(StepTime.kind, StepTime.step)))
