"""Radiographs in the database: the gray image under its SHA-256, and what must be known to measure in it."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from uuid import uuid4

from sqlalchemy import select
from sqlalchemy.orm import Session, joinedload

from contract.event import Actor
from contract.radiograph import ImageSide, RadiographKind
from spinewatch.imaging.pixel_spacing import SpacingSource
from spinewatch.spine.radiograph_landmarks import RadiographView
from store import events, images, surgeries
from store.errors import NotFoundError
from store.images import NewImage
from store.page import Page, PageRequest, page_of
from store.tables.spines import Radiograph


@dataclass(frozen=True)
class NewRadiograph:
    """A radiograph without the metadata of its file.

    Attributes
    ----------
    view
        pa or lateral.
    positive_on
        Side of the image on which the patient's left (pa) or front (lateral) lies.
    pixel_spacing_mm
        Distance of rows and of columns, mm.
    spacing_source
        Where that comes from.
    image
        The image.
    """

    view: RadiographKind
    positive_on: ImageSide
    pixel_spacing_mm: tuple[float, float]
    spacing_source: SpacingSource
    image: NewImage


def add(session: Session, surgery_id: str, new: NewRadiograph, now: datetime, actor: Actor) -> Radiograph:
    """Add a radiograph to a surgery.

    Parameters
    ----------
    session
        Session that writes.
    surgery_id
        Identifier of the surgery.
    new
        The radiograph.
    now
        Time of the upload.
    actor
        Who adds it.

    Returns
    -------
    Radiograph
        The row with its image.

    Raises
    ------
    NotFoundError
        There is no such surgery.
    """
    surgery = surgeries.get(session, surgery_id)
    row_spacing, column_spacing = new.pixel_spacing_mm
    row = Radiograph(
        id=str(uuid4()),
        surgery_id=surgery.id,
        view=new.view,
        positive_on=new.positive_on,
        row_spacing_mm=row_spacing,
        column_spacing_mm=column_spacing,
        spacing_source=new.spacing_source.value,
        image=images.add(session, new.image, now),
        created_at=now,
    )
    session.add(row)
    events.append(session, now, actor, events.Action.RADIOGRAPH_ADDED, row.id, surgery.id)
    return row


def get(session: Session, surgery_id: str, radiograph_id: str) -> Radiograph:
    """Return a radiograph of a surgery with its image.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.
    radiograph_id
        Identifier of the radiograph.

    Returns
    -------
    Radiograph
        The row.

    Raises
    ------
    NotFoundError
        There is no such surgery, or it has no such radiograph.
    """
    query = select(Radiograph).where(Radiograph.id == radiograph_id, Radiograph.surgery_id == surgery_id)
    row = session.scalars(query.options(joinedload(Radiograph.image))).one_or_none()
    if row is None:
        surgeries.get(session, surgery_id)
        raise NotFoundError("radiograph")
    return row


def listed(session: Session, surgery_id: str, wanted: PageRequest) -> Page[Radiograph]:
    """Return a page of a surgery's radiographs with their images.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.
    wanted
        Which part of the list.

    Returns
    -------
    Page of Radiograph
        The rows.

    Raises
    ------
    NotFoundError
        There is no such surgery.
    """
    surgeries.get(session, surgery_id)
    query = select(Radiograph).where(Radiograph.surgery_id == surgery_id)
    return page_of(session, query.options(joinedload(Radiograph.image)), Radiograph, wanted)


def kinds(session: Session, surgery_id: str) -> dict[str, str]:
    """Return the views of a surgery's radiographs.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.

    Returns
    -------
    dict
        ``pa`` or ``lateral`` by identifier.
    """
    rows = session.scalars(select(Radiograph).where(Radiograph.surgery_id == surgery_id))
    return {row.id: row.view for row in rows}


def views(session: Session, surgery_id: str) -> dict[str, RadiographView]:
    """Return how a surgery's radiographs map to the patient.

    Parameters
    ----------
    session
        Session that reads.
    surgery_id
        Identifier of the surgery.

    Returns
    -------
    dict
        The library's views by identifier.
    """
    rows = session.scalars(select(Radiograph).where(Radiograph.surgery_id == surgery_id))
    return {row.id: view_of(row) for row in rows}


def view_of(row: Radiograph) -> RadiographView:
    """Return how a radiograph maps to the patient.

    Parameters
    ----------
    row
        The radiograph.

    Returns
    -------
    RadiographView
        The library's view.
    """
    side: ImageSide = "left" if row.positive_on == "left" else "right"
    return RadiographView((row.row_spacing_mm, row.column_spacing_mm), side)
