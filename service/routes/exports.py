"""Exports of a surgery: one file per standard, and the report."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Path, Query, Response

from contract.base import StageName
from service.dependencies import AdmissionDep, DatabaseDep, problems
from service.etags import NOT_MODIFIED, IfNoneMatch, tagged_file
from service.export_process import ExportFile, export_apart
from service.parameters import SurgeryId
from service.routes.summary import summary_json
from service.turns import TurnsDep, in_turn
from store import summaries
from store.database import Database

router = APIRouter(prefix="/v1/surgeries/{surgery_id}/exports", tags=["exports"])

Format = Literal[
    "slicer-markups",
    "slicer-transforms",
    "gltf",
    "csv",
    "json",
    "fhir",
    "dicom-sr",
    "report-html",
    "report-pdf",
]
_FILE: dict[int | str, dict[str, Any]] = {200: {"description": "The file.", "content": {"*/*": {}}}}


@router.get(
    "/{format}",
    response_class=Response,
    responses={**_FILE, **NOT_MODIFIED, **problems(404, 422, 501, 507)},
)
async def get_export(
    surgery_id: SurgeryId,
    format: Annotated[Format, Path(description="The format; report-html and report-pdf are the report.")],
    database: DatabaseDep,
    turns: TurnsDep,
    admission: AdmissionDep,
    stage: Annotated[
        StageName | None, Query(description="One stage alone, for the formats that allow it.")
    ] = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get a surgery as a file: 3D Slicer, glTF, CSV, JSON, FHIR, DICOM SR, or a report."""
    made = await in_turn(
        turns.exporting, admission.key_prefix, _exported, database, surgery_id, format, stage
    )
    headers = {
        "Content-Disposition": f'attachment; filename="{made.file_name}"',
        "Content-Length": str(made.size),
        "X-Content-Type-Options": "nosniff",
    }
    return tagged_file(made.file, made.sha256, made.media_type, if_none_match, headers)


def _exported(database: Database, surgery_id: str, name: Format, stage: str | None) -> ExportFile:
    with database.read() as session:
        rows = summaries.get(session, surgery_id)
    return export_apart(summary_json(rows), name, stage)
