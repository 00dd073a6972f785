from datetime import datetime

import pytest
from sqlalchemy import func, select

from spinewatch.imaging.header import ImageHeader
from spinewatch.imaging.pixel_spacing import SpacingSource
from spinewatch.spine.radiograph_landmarks import RadiographView
from store import images, radiographs
from store.database import Database
from store.errors import NotFoundError
from store.images import NewImage
from store.page import PageRequest
from store.radiographs import NewRadiograph
from store.tables.events import Event
from store.tables.images import Image
from tests.store.builders import CLIENT, NOON, at, new_surgery


def added(
    database: Database, surgery: str, content: bytes = b"gray", view: str = "pa", now: datetime = NOON
) -> str:
    image = NewImage(content, ImageHeader("PNG", "image/png", 30, 40))
    new = NewRadiograph(
        view="pa" if view == "pa" else "lateral",
        positive_on="right",
        pixel_spacing_mm=(0.1 + 0.2, 0.18),
        spacing_source=SpacingSource.PIXEL_SPACING,
        image=image,
    )
    with database.write() as session:
        return radiographs.add(session, surgery, new, now, CLIENT).id


def test_a_radiograph_comes_back_with_its_image(database: Database) -> None:
    surgery = new_surgery(database)
    identifier = added(database, surgery)
    with database.read() as session:
        row = radiographs.get(session, surgery, identifier)
        assert (row.view, row.positive_on, row.spacing_source) == ("pa", "right", "pixel_spacing")
        assert (row.row_spacing_mm, row.column_spacing_mm) == (0.1 + 0.2, 0.18)
        assert images.content(session, row.image.sha256) == b"gray"
        assert (row.image.width, row.image.height) == (30, 40)
        assert row.created_at == NOON


def test_the_upload_is_an_event_of_its_actor(database: Database) -> None:
    surgery = new_surgery(database)
    identifier = added(database, surgery)
    with database.read() as session:
        event = session.scalars(select(Event).where(Event.subject_id == identifier)).one()
        assert (event.action, event.actor_name, event.surgery_id) == (
            "radiograph:added",
            "127.0.0.1",
            surgery,
        )


def test_the_same_image_is_stored_once(database: Database) -> None:
    surgery = new_surgery(database)
    assert added(database, surgery) != added(database, surgery)
    with database.read() as session:
        assert session.scalar(select(func.count()).select_from(Image)) == 1


def test_a_list_is_in_order_and_of_one_surgery(database: Database) -> None:
    surgery = new_surgery(database)
    added(database, new_surgery(database))
    late, early = (added(database, surgery, now=at(seconds)) for seconds in (2, 1))
    with database.read() as session:
        page = radiographs.listed(session, surgery, PageRequest(1))
        assert [row.id for row in page.items] == [late]
        assert page.total == 2
        whole = radiographs.listed(session, surgery, PageRequest(9, "created_at"))
        assert [row.id for row in whole.items] == [early, late]
        assert page.items[0].image.media_type == "image/png"


def test_a_setup_finds_views_and_their_spacing(database: Database) -> None:
    surgery = new_surgery(database)
    pa, lateral = added(database, surgery), added(database, surgery, b"other", "lateral")
    added(database, new_surgery(database))
    with database.read() as session:
        assert radiographs.kinds(session, surgery) == {pa: "pa", lateral: "lateral"}
        view = RadiographView((0.1 + 0.2, 0.18), "right")
        assert radiographs.views(session, surgery) == {pa: view, lateral: view}


def test_a_radiograph_of_another_surgery_is_not_found(database: Database) -> None:
    surgery, other = new_surgery(database), new_surgery(database)
    identifier = added(database, surgery)
    with database.read() as session:
        with pytest.raises(NotFoundError) as missing:
            radiographs.get(session, other, identifier)
        assert missing.value.code == "radiograph-not-found"
        with pytest.raises(NotFoundError) as missing:
            radiographs.get(session, "none", identifier)
        assert missing.value.code == "surgery-not-found"
        with pytest.raises(NotFoundError):
            radiographs.listed(session, "none", PageRequest())


def test_a_radiograph_of_no_surgery_leaves_nothing(database: Database) -> None:
    with pytest.raises(NotFoundError):
        added(database, "none")
    with database.read() as session:
        assert session.scalar(select(func.count()).select_from(Image)) == 0
