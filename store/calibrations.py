"""Calibrated rigs in the record: given as they are, or made by a worker from pictures."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime, timedelta
from typing import Any
from uuid import uuid4

from sqlalchemy import select
from sqlalchemy.orm import Session, joinedload, selectinload, undefer

from spinewatch.camera import Rig
from spinewatch.rig_files.rig_json import rig_to_dict
from store import events
from store.errors import NotFoundError, ReportNotFoundError
from store.page import Page, page_of
from store.tables import Calibration, CalibrationReport, CalibrationRequest, CalibrationShot, Stage


def add(session: Session, rig: Rig, now: datetime, calibrated_at: datetime | None = None) -> Calibration:
    """Add a calibration that somebody else made."""
    row = Calibration(
        id=str(uuid4()),
        name=rig.name,
        rig=rig_to_dict(rig),
        calibrated_at=calibrated_at,
        created_at=now,
        report=None,
    )
    session.add(row)
    events.append(session, now, events.Action.CALIBRATION_CREATED, row.id)
    return row


def add_solved(session: Session, request_id: str, result: Mapping[str, Any], now: datetime) -> None:
    """Add the calibration that a request asked for, under the request's identifier.

    ``result`` is the calibration document (``formats/calibration_json``) with ``version``.
    """
    request = session.get_one(CalibrationRequest, request_id)
    report = {key: value for key, value in result.items() if key not in {"rig", "version"}}
    session.add(
        Calibration(
            id=request_id,
            name=request.name,
            rig=result["rig"],
            calibrated_at=request.captured_at or request.created_at,
            created_at=now,
            report=CalibrationReport(report=report, version=result["version"]),
        )
    )
    events.append(session, now, events.Action.CALIBRATION_SOLVED, request_id)


def get(session: Session, calibration_id: str) -> Calibration:
    """Return a calibration; raise ``NotFoundError``."""
    return _found(session.get(Calibration, calibration_id))


def get_with_report(session: Session, calibration_id: str) -> Calibration:
    """Return a calibration with its report and the pictures it was made from; raise ``NotFoundError``."""
    return _found(session.get(Calibration, calibration_id, options=[_REPORT]))


def report_of(row: Calibration) -> CalibrationReport:
    """Return the report of a calibration got with it; raise ``ReportNotFoundError`` for one given as a rig."""
    if row.report is None:
        raise ReportNotFoundError
    return row.report


def shot_of(row: Calibration, number: int) -> CalibrationShot:
    """Return a shot, counted from 1, of a calibration got with its report; raise ``NotFoundError``."""
    shots = report_of(row).request.shots
    if number > len(shots):
        raise NotFoundError("shot")
    return shots[number - 1]


def listed(session: Session, limit: int, offset: int) -> Page[Calibration]:
    """Return a page of calibrations, oldest first."""
    query = select(Calibration).options(joinedload(Calibration.report))
    return page_of(session, query.order_by(Calibration.created_at, Calibration.id), limit, offset)


def age(calibration: Calibration, stage: Stage) -> timedelta:
    """Return how old a calibration was when a stage was taken; negative when it was made afterwards.

    A rig of unknown date, or of one to come, is taken for as old as its entry in the record: it is no younger.
    """
    taken = stage.captured_at or stage.created_at
    return taken - min(calibration.calibrated_at or calibration.created_at, calibration.created_at)


def _found(row: Calibration | None) -> Calibration:
    if row is None:
        raise NotFoundError("calibration")
    return row


_SHOTS = selectinload(CalibrationRequest.shots).options(
    joinedload(CalibrationShot.left), joinedload(CalibrationShot.right)
)
_REPORT = joinedload(Calibration.report).options(
    undefer(CalibrationReport.report), joinedload(CalibrationReport.request).options(_SHOTS)
)
