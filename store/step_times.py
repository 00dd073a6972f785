"""Histograms of the times that the steps of jobs take, over all workers: few rows, however many jobs there were."""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

from sqlalchemy import select
from sqlalchemy.dialects import postgresql, sqlite
from sqlalchemy.orm import Session

from store.tables.jobs import StepTime

BOUNDS_S = (0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0, 60.0)
"""Largest time of each bucket, s; a further bucket has longer times. Rows refer to their order."""


@dataclass(frozen=True)
class StepHistogram:
    """The times of a step of jobs of one kind.

    Attributes
    ----------
    kind
        Kind of the jobs.
    step
        The step.
    counts
        Number of times in each bucket, the one beyond the last bound included.
    seconds
        Sum of all times, s.
    """

    kind: str
    step: str
    counts: tuple[int, ...]
    seconds: float


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
    if not seconds:
        return
    insert = postgresql.insert if session.get_bind().dialect.name == "postgresql" else sqlite.insert
    new = insert(StepTime)
    added = {"count": StepTime.count + 1, "seconds": StepTime.seconds + new.excluded.seconds}
    rows = [  # in one order, so that two workers never wait for each other
        {
            "kind": kind,
            "step": step,
            "bucket": bisect_left(BOUNDS_S, seconds[step]),
            "count": 1,
            "seconds": seconds[step],
        }
        for step in sorted(seconds)
    ]
    session.execute(new.on_conflict_do_update(index_elements=["kind", "step", "bucket"], set_=added), rows)


def listed(session: Session) -> list[StepHistogram]:
    """Return the histograms.

    Parameters
    ----------
    session
        Session that reads.

    Returns
    -------
    list of StepHistogram
        One per kind and step, in their order.
    """
    counts: dict[tuple[str, str], list[int]] = defaultdict(lambda: [0] * (len(BOUNDS_S) + 1))
    seconds: dict[tuple[str, str], float] = defaultdict(float)
    for row in session.scalars(select(StepTime).order_by(StepTime.kind, StepTime.step, StepTime.bucket)):
        counts[row.kind, row.step][row.bucket] = row.count
        seconds[row.kind, row.step] += row.seconds
    return [StepHistogram(*key, tuple(found), seconds[key]) for key, found in counts.items()]
