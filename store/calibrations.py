"""Calibrated rigs in the record."""

from __future__ import annotations

from datetime import datetime
from uuid import uuid4

from sqlalchemy import select
from sqlalchemy.orm import Session

from spinewatch.camera import Rig
from spinewatch.formats.rig_json import rig_to_dict
from store import changes
from store.errors import NotFoundError
from store.page import Page, page_of
from store.tables import Calibration


def add(session: Session, rig: Rig, now: datetime) -> Calibration:
    """Add a calibration."""
    row = Calibration(id=str(uuid4()), name=rig.name, rig=rig_to_dict(rig), created_at=now)
    session.add(row)
    changes.append(session, now, changes.Action.CALIBRATION_CREATED, row.id)
    return row


def get(session: Session, calibration_id: str) -> Calibration:
    """Return a calibration; raise ``NotFoundError``."""
    row = session.get(Calibration, calibration_id)
    if row is None:
        raise NotFoundError("calibration")
    return row


def listed(session: Session, limit: int, offset: int) -> Page[Calibration]:
    """Return a page of calibrations, oldest first."""
    return page_of(
        session, select(Calibration).order_by(Calibration.created_at, Calibration.id), limit, offset
    )
