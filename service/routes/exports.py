"""Exports of a surgery: one file per standard, and the report."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from fastapi import APIRouter, Path, Query, Response

from contract.base import StageName
from contract.summary import SurgerySummary
from exports.formats import Export, export_surgery, file_name
from reports.pdf import to_pdf
from reports.surgery import render_surgery
from service.dependencies import DatabaseDep, problems
from service.etags import NOT_MODIFIED, IfNoneMatch, tagged_response
from service.parameters import SurgeryId
from service.routes.summary import summary_json
from store import summaries

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
    responses={**_FILE, **NOT_MODIFIED, **problems(404, 422, 501)},
)
def get_export(
    surgery_id: SurgeryId,
    format: Annotated[Format, Path(description="The format; report-html and report-pdf are the report.")],
    database: DatabaseDep,
    stage: Annotated[
        StageName | None, Query(description="One stage alone, for the formats that allow it.")
    ] = None,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Get a surgery as a file: 3D Slicer, glTF, CSV, JSON, FHIR, DICOM SR, or a report."""
    with database.read() as session:
        rows = summaries.get(session, surgery_id)
    made = _export(SurgerySummary.model_validate_json(summary_json(rows)), format, stage)
    headers = {
        "Content-Disposition": f'attachment; filename="{made.file_name}"',
        "X-Content-Type-Options": "nosniff",
    }
    return tagged_response(made.content, made.media_type, if_none_match, headers)


def _export(summary: SurgerySummary, name: Format, stage: str | None) -> Export:
    if name not in {"report-html", "report-pdf"}:
        return export_surgery(summary, name, stage)
    if name == "report-html":
        page = render_surgery(summary).encode()
        return Export(page, "text/html; charset=utf-8", file_name(summary, ".html"))
    return Export(to_pdf(render_surgery(summary)), "application/pdf", file_name(summary, ".pdf"))
