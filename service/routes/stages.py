"""Stages: submitting stereo pairs, and their images and results."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Depends, Form, Response

from contract.flag import Flag
from contract.page import Listing
from contract.stage import CountPair, Stage, StageFeatures, StageTriads
from service.dependencies import (
    ACCEPTED,
    ActorDep,
    ClockToleranceDep,
    DatabaseDep,
    QueueDep,
    enqueue,
    multipart_body,
    problems,
)
from service.forms.stage import StageForm, read_pair, require_calibrated_sizes
from service.images import FILE_RESPONSES, IfNoneMatch, SidePath, file_response, image_pair
from service.parameters import Limit, Offset, StagePath, SurgeryId, require_plausible_time
from service.problems import InvalidInputError
from service.routes.jobs import job_of
from store import calibrations, measurements, stages, surgeries, tables
from store.clock import utc_now
from store.errors import NotFoundError

router = APIRouter(prefix="/v1/surgeries/{surgery_id}/stages", tags=["stages"])


@router.post(
    "",
    status_code=202,
    dependencies=[Depends(multipart_body)],
    responses={**ACCEPTED, **problems(400, 404, 409, 413, 415, 422)},
)
def submit_stage(
    surgery_id: SurgeryId,
    form: Annotated[StageForm, Form(media_type="multipart/form-data")],
    database: DatabaseDep,
    queue: QueueDep,
    actor: ActorDep,
    tolerance: ClockToleranceDep,
    response: Response,
) -> Stage:
    """Submit a stereo pair for measurement.

    Either everything is stored or nothing. A name in use is rejected unless its latest job failed or was cancelled; the
    pair is then its next take.
    """
    now = utc_now()
    require_plausible_time("captured_at", form.captured_at, now, tolerance)
    left, right = read_pair(form)
    with database.write() as session:
        surgery = surgeries.get(session, surgery_id)
        try:
            calibration = calibrations.get(session, form.calibration_id)
        except NotFoundError as error:
            raise InvalidInputError("calibration_id", error) from error
        require_calibrated_sizes(left, right, calibration)
        new = stages.NewStage(form.name, left, right, form.captured_at)
        stage = stages.submit(session, surgery, calibration, new, now, actor)
    enqueue(queue, stage.job.id)
    response.headers["Location"] = f"/v1/jobs/{stage.job.id}"
    return _stage(stage)


@router.get("", responses=problems(404, 422))
def list_stages(
    surgery_id: SurgeryId, database: DatabaseDep, limit: Limit = 50, offset: Offset = 0
) -> Listing[Stage]:
    """List all takes of the stages of a surgery, oldest first."""
    with database.read() as session:
        surgeries.get(session, surgery_id)
        page = stages.listed(session, surgery_id, limit, offset)
    return Listing(items=[_stage(row) for row in page.items], total=page.total, limit=limit, offset=offset)


@router.get("/{name}", responses=problems(404))
def get_stage(surgery_id: SurgeryId, name: StagePath, database: DatabaseDep) -> Stage:
    """Get the latest take of a stage."""
    with database.read() as session:
        return _stage(stages.get(session, surgery_id, name))


@router.get("/{name}/triads", responses=problems(404, 409))
def get_triads(surgery_id: SurgeryId, name: StagePath, database: DatabaseDep) -> StageTriads:
    """Get the triads of a measured stage in label order; those without a label come last."""
    with database.read() as session:
        stage, measured = measurements.get(session, surgery_id, name)
        triads = measurements.triads(session, stage.id)
    result = measured.result
    return StageTriads(
        surgery_id=surgery_id,
        stage=stage.name,
        take=stage.take,
        frame=f"object space of calibration {stage.calibration.name}",
        triads=triads,
        flags=[Flag(**flag) for flag in result["flags"]],
        parameters=result["parameters"],
        templates=result["templates"],
        version=result["version"],
    )


@router.get("/{name}/features", responses=problems(404, 409))
def get_features(surgery_id: SurgeryId, name: StagePath, database: DatabaseDep) -> StageFeatures:
    """Get the possible ball centres of a measured stage, best score first."""
    with database.read() as session:
        stage, measured = measurements.get(session, surgery_id, name)
        features = measurements.features(session, stage.id)
    return StageFeatures.model_validate(
        {
            "surgery_id": surgery_id,
            "stage": stage.name,
            "take": stage.take,
            "fields": measured.result["fields"],
            "exposure": measured.result["exposure"],
            "features": features,
        }
    )


@router.get(
    "/{name}/images/{side}",
    response_class=Response,
    responses=FILE_RESPONSES,
)
def get_image(
    surgery_id: SurgeryId,
    name: StagePath,
    side: SidePath,
    database: DatabaseDep,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get the original image file; its ETag is its SHA-256."""
    with database.read() as session:
        stage = stages.get(session, surgery_id, name)
        image = stage.left if side == "left" else stage.right
        return file_response(session, image, if_none_match)


def _stage(row: tables.Stage) -> Stage:
    """Return the model of a row with its images, job and measurement."""
    measured = row.measurement
    counts = {} if measured is None else {features.side: features.count for features in measured.features}
    return Stage(
        id=row.id,
        surgery_id=row.surgery_id,
        name=row.name,
        take=row.take,
        calibration_id=row.calibration_id,
        captured_at=row.captured_at,
        created_at=row.created_at,
        images=image_pair(row.left, row.right),
        state=row.job.state,
        job=job_of(row.job, row),
        features=CountPair(**counts) if counts else None,
        triads=None if measured is None else measured.triad_count,
        flags=None if measured is None else [Flag(**flag) for flag in measured.result["flags"]],
        version=None if measured is None else measured.result["version"],
    )
