"""Requests to calibrate: pictures of a control field, and what a worker needs to make a calibration of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from uuid import uuid4

from sqlalchemy import select
from sqlalchemy.orm import Session, selectinload

from store import events, images, jobs
from store.images import NewImage
from store.tables import CalibrationRequest, CalibrationShot, Document


@dataclass(frozen=True)
class NewShot:
    """A stereo pair of the control field; one that is not ``used`` only verifies."""

    left: NewImage
    right: NewImage
    used: bool


@dataclass(frozen=True)
class NewRequest:
    """What is to be calibrated, from what and how; the columns of ``CalibrationRequest`` explain it."""

    name: str
    control_field: str
    control_points: str | None
    options: Document
    shots: Sequence[NewShot]
    captured_at: datetime | None


def submit(session: Session, new: NewRequest, now: datetime) -> CalibrationRequest:
    """Add a request with its pictures and its queued job."""
    request = CalibrationRequest(
        id=str(uuid4()),
        name=new.name,
        control_field=new.control_field,
        control_points=new.control_points,
        options=new.options,
        captured_at=new.captured_at,
        created_at=now,
        shots=[
            CalibrationShot(
                position=position,
                used=shot.used,
                left=images.keep(session, shot.left, now),
                right=images.keep(session, shot.right, now),
            )
            for position, shot in enumerate(new.shots)
        ],
        job=jobs.queued(now),
    )
    session.add(request)
    events.append(session, now, events.Action.CALIBRATION_SUBMITTED, request.id)
    return request


@dataclass(frozen=True)
class CalibrationWork:
    """What a worker needs to calibrate: all of a request, and the files (left, right) of each shot in order."""

    name: str
    control_field: str
    control_points: str | None
    options: Document
    pairs: Sequence[tuple[bytes, bytes]]
    verify: int


def work(session: Session, request_id: str) -> CalibrationWork:
    """Return what there is to calibrate."""
    query = select(CalibrationRequest).where(CalibrationRequest.id == request_id)
    request = session.scalars(query.options(selectinload(CalibrationRequest.shots))).one()
    return CalibrationWork(
        name=request.name,
        control_field=request.control_field,
        control_points=request.control_points,
        options=request.options,
        pairs=[
            (images.content(session, shot.left_sha256), images.content(session, shot.right_sha256))
            for shot in request.shots
        ],
        verify=sum(not shot.used for shot in request.shots),
    )
