"""Requests to calibrate: images of a control field, and what a worker needs to calibrate with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from uuid import uuid4

from sqlalchemy import select
from sqlalchemy.orm import Session, selectinload
from sqlalchemy.orm.attributes import set_committed_value

from contract.event import Actor
from store import events, images, jobs
from store.images import NewImage
from store.tables.base import Document
from store.tables.calibrations import CalibrationRequest, CalibrationShot
from store.tables.jobs import CALIBRATION_JOB


@dataclass(frozen=True)
class NewShot:
    """A stereo pair of the control field.

    Attributes
    ----------
    left, right
        The images.
    used
        False for a shot held out for verification.
    """

    left: NewImage
    right: NewImage
    used: bool


@dataclass(frozen=True)
class NewRequest:
    """The input of a calibration.

    Attributes
    ----------
    name
        Name of the rig.
    control_field
        Name of a built-in control field, or of the one in ``control_points``.
    control_points
        CSV of the control points, None for a built-in control field.
    options
        Options of ``spinewatch calibrate``: pixel_size_mm, free, fixed, estimate_aspect.
    shots
        The stereo pairs.
    captured_at
        When they were taken, None when unknown.
    """

    name: str
    control_field: str
    control_points: str | None
    options: Document
    shots: Sequence[NewShot]
    captured_at: datetime | None


def submit(session: Session, new: NewRequest, now: datetime, actor: Actor) -> CalibrationRequest:
    """Add a request with its images and its queued job.

    Parameters
    ----------
    session
        Session that writes.
    new
        The input.
    now
        Time of the submission.
    actor
        Who submits.

    Returns
    -------
    CalibrationRequest
        The row with its job; the caller enqueues the job after the commit.
    """
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
                left=images.add(session, shot.left, now),
                right=images.add(session, shot.right, now),
            )
            for position, shot in enumerate(new.shots)
        ],
    )
    session.add(request)
    job = jobs.add(session, CALIBRATION_JOB, request.id, now)
    set_committed_value(request, "job", job)
    events.append(session, now, actor, events.Action.CALIBRATION_SUBMITTED, request.id)
    return request


@dataclass(frozen=True)
class CalibrationWork:
    """What a worker needs to calibrate.

    Attributes
    ----------
    name, control_field, control_points, options
        As of ``NewRequest``.
    pairs
        The image files (left, right) of each shot, in order.
    verify
        Number of trailing shots held out for verification.
    """

    name: str
    control_field: str
    control_points: str | None
    options: Document
    pairs: Sequence[tuple[bytes, bytes]]
    verify: int


def work(session: Session, request_id: str) -> CalibrationWork:
    """Return what a worker needs to calibrate.

    Parameters
    ----------
    session
        Session that reads.
    request_id
        Identifier of the request.

    Returns
    -------
    CalibrationWork
        Images, control field and options.
    """
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
