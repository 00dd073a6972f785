"""Figures of the record for health checks and metrics: each query stays fast however much there is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from contract.job import JobState
from store.processes import database_time
from store.tables.calibrations import Calibration
from store.tables.jobs import Job
from store.tables.measurements import Measurement
from store.tables.stages import Stage

MAX_CALIBRATIONS = 10
"""Calibrations, the newest, whose drift is reported."""

_STAGES = 5
"""Stages, the last, of which one must have had enough balls."""


@dataclass(frozen=True)
class Drift:
    """How far the rig of a calibration has moved, by the last stage that could tell.

    Attributes
    ----------
    calibration_id
        The calibration.
    name
        Name of its rig.
    shift_mm
        Length of the shift, mm.
    rotation_deg
        Largest rotation about an axis, degrees.
    """

    calibration_id: str
    name: str
    shift_mm: float
    rotation_deg: float


def jobs_by_state(session: Session) -> Mapping[JobState, int]:
    """Return the number of jobs in each state.

    Parameters
    ----------
    session
        Session that reads.

    Returns
    -------
    mapping of JobState to int
        The numbers; every state is in it.
    """
    counts = session.execute(select(Job.state, func.count()).group_by(Job.state))
    return dict.fromkeys(JobState, 0) | {row[0]: row[1] for row in counts}


def queue_seconds(session: Session) -> float:
    """Return the time that the oldest job has waited for a worker.

    A job that waits for another one to end does not count.

    Parameters
    ----------
    session
        Session that reads.

    Returns
    -------
    float
        The time, s; 0 when none waits.
    """
    waiting = select(func.min(Job.created_at)).where(Job.state == JobState.QUEUED, Job.waits_for.is_(None))
    oldest = session.scalar(waiting)
    return 0.0 if oldest is None else max((database_time(session) - oldest).total_seconds(), 0.0)


def drifts(session: Session) -> list[Drift]:
    """Return the drift of the newest calibrations, each by the last stages that were measured with it.

    Parameters
    ----------
    session
        Session that reads.

    Returns
    -------
    list of Drift
        The newest calibration first; those without a check are left out.
    """
    newest = select(Calibration.id, Calibration.name).order_by(Calibration.created_at.desc(), Calibration.id)
    found = []
    for calibration_id, name in session.execute(newest.limit(MAX_CALIBRATIONS)):
        last = (
            select(Measurement.result["rig_check"])
            .join(Stage)
            .where(Stage.calibration_id == calibration_id)
            .order_by(Stage.created_at.desc())
            .limit(_STAGES)
        )
        check = next((check for check in session.scalars(last) if check), None)
        if check is not None:
            found.append(_drift(calibration_id, name, check))
    return found


def _drift(calibration_id: str, name: str, check: Mapping[str, Any]) -> Drift:
    shift = sum(value**2 for value in check["shift_mm"]) ** 0.5
    return Drift(calibration_id, name, shift, max(abs(value) for value in check["rotation_deg"]))
