"""What a lease gives the right to work on."""

from __future__ import annotations

from sqlalchemy.orm import Session

from store import calibration_requests, stages
from store.calibration_requests import CalibrationWork
from store.jobs import Lease
from store.stages import StageWork
from store.tables import JobKind

Work = StageWork | CalibrationWork


def work_of(session: Session, lease: Lease) -> Work:
    """Return everything that the work of a lease needs."""
    if lease.kind is JobKind.CALIBRATION:
        return calibration_requests.work(session, lease.subject_id)
    return stages.work(session, lease.subject_id)
