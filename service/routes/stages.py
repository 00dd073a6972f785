"""Stages: sending stereo pairs, and the pictures and results of each."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Form, Response
from pydantic import Field

from contract.base import Identifier, Limit, Listing, Offset, Schema, StageName, Timestamp
from contract.results import FeaturesDocument, FlagDocument, TriadDocument, TriadsDocument, object_space
from service.dependencies import ACCEPTED, TheDatabase, TheQueue, multipart_body, problems, ring
from service.forms.stage import StageForm, read_pair, require_calibrated_sizes
from service.images import FILE_RESPONSES, IfNoneMatch, PairDocument, Side, file_response
from service.problems import InvalidInputError
from service.routes.jobs import JobDocument
from store import calibrations, stages, surgeries
from store.clock import utc_now
from store.errors import NotFoundError
from store.tables import JobState, Stage

router = APIRouter(prefix="/v1/surgeries/{surgery_id}/stages", tags=["stages"])


class CountsDocument(Schema):
    """How many features were found in each view."""

    left: int
    right: int


class StageDocument(Schema):
    """One take of a stage; what was measured is null until the job has succeeded."""

    id: Identifier
    surgery_id: Identifier
    name: StageName
    take: Annotated[int, Field(ge=1, description="Counts the takes of this name; results are of the latest.")]
    calibration_id: Identifier
    captured_at: Timestamp | None
    created_at: Timestamp
    images: PairDocument
    state: JobState
    job: JobDocument
    features: Annotated[CountsDocument | None, Field(description="Counts of features.")]
    triads: Annotated[int | None, Field(description="Count of triads.")]
    flags: list[FlagDocument] | None
    version: Annotated[str | None, Field(description="The version of Spinewatch that measured it.")]

    @classmethod
    def of(cls, stage: Stage) -> StageDocument:
        """Return the document of a row with its pictures, job and measurement."""
        measured = stage.measurement
        counts = {} if measured is None else {row.side: row.count for row in measured.features}
        return cls(
            id=stage.id,
            surgery_id=stage.surgery_id,
            name=stage.name,
            take=stage.take,
            calibration_id=stage.calibration_id,
            captured_at=stage.captured_at,
            created_at=stage.created_at,
            images=PairDocument.of(stage.left, stage.right),
            state=stage.job.state,
            job=JobDocument.of(stage.job, stage),
            features=CountsDocument(**counts) if counts else None,
            triads=None if measured is None else len(measured.triads),
            flags=None if measured is None else [FlagDocument(**flag) for flag in measured.flags],
            version=None if measured is None else measured.version,
        )


@router.post(
    "",
    status_code=202,
    dependencies=[Depends(multipart_body)],
    responses={**ACCEPTED, **problems(400, 404, 409, 413, 415, 422)},
)
def submit_stage(
    surgery_id: str,
    form: Annotated[StageForm, Form(media_type="multipart/form-data")],
    record: TheDatabase,
    bell: TheQueue,
    response: Response,
) -> StageDocument:
    """Send a stereo pair to be measured; everything is stored, or nothing.

    A name in use is refused, unless its latest job failed or was cancelled: then this is its next take.
    """
    left, right = read_pair(form)
    with record.writing() as session:
        surgery = surgeries.get(session, surgery_id)
        try:
            calibration = calibrations.get(session, form.calibration_id)
        except NotFoundError as error:
            raise InvalidInputError("calibration_id", error) from error
        require_calibrated_sizes(left, right, calibration)
        new = stages.NewStage(form.name, left, right, form.captured_at)
        stage = stages.submit(session, surgery, calibration, new, utc_now())
    ring(bell, stage.job.id)
    response.headers["Location"] = f"/v1/jobs/{stage.job.id}"
    return StageDocument.of(stage)


@router.get("", responses=problems(404, 422))
def list_stages(
    surgery_id: str, record: TheDatabase, limit: Limit = 50, offset: Offset = 0
) -> Listing[StageDocument]:
    """List every take of a surgery's stages, oldest first."""
    with record.reading() as session:
        surgeries.get(session, surgery_id)
        page = stages.listed(session, surgery_id, limit, offset)
    items = [StageDocument.of(stage) for stage in page.items]
    return Listing(items=items, total=page.total, limit=limit, offset=offset)


@router.get("/{name}", responses=problems(404))
def get_stage(surgery_id: str, name: str, record: TheDatabase) -> StageDocument:
    """Show the latest take of a stage."""
    with record.reading() as session:
        return StageDocument.of(stages.get(session, surgery_id, name))


@router.get("/{name}/triads", responses=problems(404, 409))
def get_triads(surgery_id: str, name: str, record: TheDatabase) -> TriadsDocument:
    """Show the triads of a measured stage in label order, those without a label last."""
    with record.reading() as session:
        stage, measured = stages.measurement(session, surgery_id, name)
    return TriadsDocument(
        surgery_id=surgery_id,
        stage=stage.name,
        take=stage.take,
        frame=object_space(stage),
        triads=[TriadDocument.of(triad) for triad in measured.triads],
        flags=[FlagDocument(**flag) for flag in measured.flags],
        parameters=measured.parameters,
        version=measured.version,
    )


@router.get("/{name}/features", responses=problems(404, 409))
def get_features(surgery_id: str, name: str, record: TheDatabase) -> FeaturesDocument:
    """Show the possible ball centres of a measured stage, best score first."""
    with record.reading() as session:
        stage, measured = stages.measurement(session, surgery_id, name)
        points = stages.features(session, stage.id)
    return FeaturesDocument.model_validate(
        {
            "surgery_id": surgery_id,
            "stage": stage.name,
            "take": stage.take,
            "fields": measured.fields,
            "exposure": measured.exposure,
            "features": points,
        }
    )


@router.get(
    "/{name}/images/{side}",
    response_class=Response,
    responses=FILE_RESPONSES,
)
def get_image(
    surgery_id: str,
    name: str,
    side: Side,
    record: TheDatabase,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Return the original file; its ETag is its SHA-256."""
    with record.reading() as session:
        stage = stages.get(session, surgery_id, name)
        image = stage.left if side == "left" else stage.right
        return file_response(session, image, if_none_match)
