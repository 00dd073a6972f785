"""Radiographs of a surgery: upload without metadata, and the fit of their landmarks to object space."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

from fastapi import APIRouter, Depends, Form, Path, Response
from starlette.concurrency import run_in_threadpool

from contract.event import Actor
from contract.page import Listing
from contract.radiograph import (
    NewRadiographFit,
    Radiograph,
    RadiographFit,
    common_points,
    landmarked_vertebra,
)
from service.dependencies import (
    CREATED,
    ActorDep,
    AdmissionDep,
    DatabaseDep,
    json_body,
    multipart_body,
    problems,
)
from service.etags import NOT_MODIFIED, IfNoneMatch, document_response
from service.forms.radiograph import RadiographForm, read_new_radiograph
from service.idempotency import Once, OnceDep
from service.images import FILE_RESPONSES, file_response, image_of
from service.paging import CreatedSort, Paging, PartDep
from service.parameters import SurgeryId
from service.problems import InvalidInputError
from service.turns import TurnsDep, in_turn
from spinewatch.errors import SpinewatchError
from spinewatch.imaging.pixel_spacing import SpacingSource
from spinewatch.spine.radiograph_landmarks import RadiographView
from spinewatch.spine.radiographs import initial_from_radiographs
from spinewatch.triads.pose import Pose
from store import measurements, radiographs, surgeries, tables
from store.clock import utc_now
from store.database import Database
from store.radiographs import NewRadiograph

router = APIRouter(prefix="/v1/surgeries/{surgery_id}/radiographs", tags=["radiographs"])

RadiographId = Annotated[str, Path(description="Identifier of the radiograph.")]


class UnknownRadiographError(SpinewatchError):
    """The surgery has no radiograph of this identifier and view."""

    code = "unknown-radiograph"


@router.post(
    "",
    status_code=201,
    dependencies=[Depends(multipart_body)],
    responses={**CREATED, **problems(400, 404, 413, 415, 422)},
    response_model=Radiograph,
)
async def add_radiograph(
    surgery_id: SurgeryId,
    form: Annotated[RadiographForm, Form(media_type="multipart/form-data")],
    database: DatabaseDep,
    turns: TurnsDep,
    admission: AdmissionDep,
    once: OnceDep,
    actor: ActorDep,
) -> Response:
    """Store a radiograph as gray levels.

    The file itself is not stored: a new PNG is made from its pixels, so that nothing else of it remains. A DICOM file
    must be uncompressed; its first window is applied.
    """
    await run_in_threadpool(_require_surgery, database, surgery_id)
    new = await in_turn(turns.decoding, admission.key_prefix, read_new_radiograph, form)
    async with turns.writing.turn(admission.key_prefix):
        return await run_in_threadpool(_added, surgery_id, new, once, actor)


@router.get("", responses={**NOT_MODIFIED, **problems(404, 422)}, response_model=Listing[Radiograph])
def list_radiographs(
    surgery_id: SurgeryId,
    database: DatabaseDep,
    part: PartDep,
    sort: CreatedSort = "-created_at",
) -> Response:
    """List the radiographs of a surgery, newest first."""
    paging = Paging(part.limit, sort, part.cursor, surgery_id=surgery_id)
    with database.read() as session:
        page = radiographs.listed(session, surgery_id, paging.wanted)
    items = [_radiograph(row) for row in page.items]
    return document_response(
        Listing[Radiograph].model_validate(paging.document(page, items)), part.if_none_match
    )


@router.post("/fit", dependencies=[Depends(json_body)], responses=problems(404, 409, 413, 415, 422))
def try_radiograph_fit(surgery_id: SurgeryId, new: NewRadiographFit, database: DatabaseDep) -> RadiographFit:
    """Try how landmarks fit to object space and the views to each other.

    Nothing is stored, so that it may be sent again without an Idempotency-Key.
    """
    with database.read() as session:
        surgery = surgeries.get(session, surgery_id)
        views, kinds = radiographs.views(session, surgery_id), radiographs.kinds(session, surgery_id)
        triads: Mapping[str, Pose] = {}
        if new.stage is not None:
            stage, _ = measurements.get(session, surgery_id, new.stage)
            triads = measurements.poses(session, stage.id)
    points, left_out = common_points(new.initial, triads)
    _, fit = initial_from_radiographs(
        _view(views, kinds, "pa", new.initial.pa),
        _view(views, kinds, "lateral", new.initial.lateral),
        [landmarked_vertebra(vertebra) for vertebra in new.initial.vertebrae],
        points,
        new.initial.landmark_sd_px,
        surgery.extra_levels,
    )
    return RadiographFit.of(fit, left_out)


@router.get("/{radiograph_id}", responses={**NOT_MODIFIED, **problems(404)}, response_model=Radiograph)
def get_radiograph(
    surgery_id: SurgeryId,
    radiograph_id: RadiographId,
    database: DatabaseDep,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get what is known of a radiograph."""
    with database.read() as session:
        row = radiographs.get(session, surgery_id, radiograph_id)
    return document_response(_radiograph(row), if_none_match)


@router.get("/{radiograph_id}/image", response_class=Response, responses=FILE_RESPONSES)
def get_radiograph_image(
    surgery_id: SurgeryId,
    radiograph_id: RadiographId,
    database: DatabaseDep,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get the image as PNG; its ETag is its SHA-256."""
    with database.read() as session:
        row = radiographs.get(session, surgery_id, radiograph_id).image
    return file_response(database, row, if_none_match)


def _require_surgery(database: Database, surgery_id: str) -> None:
    with database.read() as session:
        surgeries.get(session, surgery_id)


def _added(surgery_id: str, new: NewRadiograph, once: Once, actor: Actor) -> Response:
    with once.write() as session:
        row = radiographs.add(session, surgery_id, new, utc_now(), actor)
        location = f"/v1/surgeries/{surgery_id}/radiographs/{row.id}"
        return once.answer(_radiograph(row), 201, Location=location)


def _view(
    views: Mapping[str, RadiographView], kinds: Mapping[str, str], kind: str, identifier: str
) -> RadiographView:
    """Return a radiograph of the surgery, which must show that view."""
    if kinds.get(identifier) != kind:
        error = UnknownRadiographError(
            f"this surgery has no {kind} radiograph of that identifier; take one from the list of its radiographs"
        )
        raise InvalidInputError(f"initial.{kind}", error)
    return views[identifier]


def _radiograph(row: tables.spines.Radiograph) -> Radiograph:
    return Radiograph.model_validate(
        {
            "id": row.id,
            "surgery_id": row.surgery_id,
            "view": row.view,
            "positive_on": row.positive_on,
            "pixel_spacing_mm": [row.row_spacing_mm, row.column_spacing_mm],
            "spacing_source": SpacingSource(row.spacing_source),
            "image": image_of(row.image),
            "created_at": row.created_at,
        }
    )
