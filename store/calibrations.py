"""Calibrated rigs in the database: given as they are, or made by a worker from images."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from datetime import datetime, timedelta
from uuid import uuid4

from sqlalchemy import select
from sqlalchemy.orm import Session, joinedload, selectinload, undefer

from contract.calibration import CalibrationBrief, CalibrationResult
from contract.event import Actor
from spinewatch.camera import Rig
from spinewatch.rig_files.rig_json import rig_to_dict
from store import events
from store.errors import NotFoundError, ReportNotFoundError
from store.page import Page, PageRequest, created_within, page_of
from store.tables.calibrations import Calibration, CalibrationReport, CalibrationRequest, CalibrationShot
from store.tables.stages import Stage


def add(
    session: Session, rig: Rig, now: datetime, actor: Actor, calibrated_at: datetime | None = None
) -> Calibration:
    """Add a calibration that was made elsewhere.

    Parameters
    ----------
    session
        Session that writes.
    rig
        The rig.
    now
        Time of the addition.
    actor
        Who adds it.
    calibrated_at
        When it was calibrated, None when unknown.

    Returns
    -------
    Calibration
        The new row.
    """
    row = Calibration(
        id=str(uuid4()),
        name=rig.name,
        rig=rig_to_dict(rig),
        calibrated_at=calibrated_at,
        created_at=now,
        report=None,
    )
    session.add(row)
    events.append(session, now, actor, events.Action.CALIBRATION_CREATED, row.id)
    return row


def add_solved(
    session: Session, request_id: str, result: CalibrationResult, now: datetime, actor: Actor
) -> None:
    """Add the calibration that was requested, under the request's identifier.

    Parameters
    ----------
    session
        Session that writes.
    request_id
        Identifier of the request.
    result
        The rig and its quality.
    now
        Time of the result.
    actor
        The worker.
    """
    request = session.get_one(CalibrationRequest, request_id)
    session.add(
        Calibration(
            id=request_id,
            name=request.name,
            rig=result.rig.model_dump(mode="json"),
            calibrated_at=request.captured_at or request.created_at,
            created_at=now,
            report=CalibrationReport(
                report=result.model_dump(mode="json", exclude={"rig", "version"}), version=result.version
            ),
        )
    )
    events.append(session, now, actor, events.Action.CALIBRATION_SOLVED, request_id)


def get(session: Session, calibration_id: str) -> Calibration:
    """Return a calibration.

    Parameters
    ----------
    session
        Session that reads.
    calibration_id
        Identifier of the calibration.

    Returns
    -------
    Calibration
        The row.

    Raises
    ------
    NotFoundError
        There is no such calibration.
    """
    return _found(session.get(Calibration, calibration_id))


def get_with_report(session: Session, calibration_id: str) -> Calibration:
    """Return a calibration with its report and the images that it was made from.

    Parameters
    ----------
    session
        Session that reads.
    calibration_id
        Identifier of the calibration.

    Returns
    -------
    Calibration
        The row.

    Raises
    ------
    NotFoundError
        There is no such calibration.
    """
    return _found(session.get(Calibration, calibration_id, options=[_REPORT]))


def briefs(session: Session, calibration_ids: Iterable[str]) -> Mapping[str, CalibrationBrief]:
    """Return the quality of calibrations in brief, without their points.

    Parameters
    ----------
    session
        Session that reads.
    calibration_ids
        Identifiers of calibrations.

    Returns
    -------
    mapping of str to CalibrationBrief
        By identifier, of those that were made from images.
    """
    report = CalibrationReport.report
    query = select(CalibrationReport.calibration_id, report["leave_one_out"], report["flags"])
    rows = session.execute(query.where(CalibrationReport.calibration_id.in_(list(calibration_ids))))
    return {
        id_: CalibrationBrief(
            leave_one_out_sd_mm=None if left_out is None else left_out["sd_mm"], flags=flags
        )
        for id_, left_out, flags in rows
    }


def report_of(row: Calibration) -> CalibrationReport:
    """Return the report of a calibration.

    Parameters
    ----------
    row
        A row from ``get_with_report``.

    Returns
    -------
    CalibrationReport
        The row of its report.

    Raises
    ------
    ReportNotFoundError
        The calibration was given as a rig.
    """
    if row.report is None:
        raise ReportNotFoundError
    return row.report


def shot_of(row: Calibration, number: int) -> CalibrationShot:
    """Return a shot of a calibration.

    Parameters
    ----------
    row
        A row from ``get_with_report``.
    number
        Number of the shot, from 1.

    Returns
    -------
    CalibrationShot
        The row of the shot.

    Raises
    ------
    NotFoundError
        The calibration has no such shot, or was given as a rig.
    """
    shots = report_of(row).request.shots
    if number > len(shots):
        raise NotFoundError("shot")
    return shots[number - 1]


def listed(
    session: Session,
    wanted: PageRequest,
    *,
    name: str | None = None,
    created_after: datetime | None = None,
    created_before: datetime | None = None,
) -> Page[Calibration]:
    """Return a page of calibrations.

    Parameters
    ----------
    session
        Session that reads.
    wanted
        Which part of the list.
    name
        Only those of the rig of this name.
    created_after, created_before
        Only those created at the first time or later, and before the second one.

    Returns
    -------
    Page of Calibration
        The rows; their reports are not loaded.
    """
    query = created_within(select(Calibration), Calibration, created_after, created_before)
    if name is not None:
        query = query.where(Calibration.name == name)
    return page_of(session, query.options(joinedload(Calibration.report)), Calibration, wanted)


def age(calibration: Calibration, stage: Stage) -> timedelta:
    """Return the age of a calibration when a stage was taken.

    A rig whose date is unknown or in the future has the age of its row: it is at least as old.

    Parameters
    ----------
    calibration
        The calibration.
    stage
        The stage.

    Returns
    -------
    timedelta
        The age; negative when the calibration was made afterwards.
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
