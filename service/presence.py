"""Surgeries that were deleted: every path of one answers 410."""

from __future__ import annotations

from sqlalchemy.orm import Session

from service.declared_routes import CONTROL
from store import retention
from store.errors import SurgeryDeletedError

_SURGERY = "/v1/surgeries/{surgery_id}"
_PLACE = _SURGERY.split("/").index("{surgery_id}")


def surgery_of(template: str | None, path: str) -> str | None:
    """Return the identifier of the surgery that a path belongs to, None for another; ``template`` is its route's."""
    if template is None or not (template == _SURGERY or template.startswith(f"{_SURGERY}/")):
        return None
    surgery_id = path.split("/")[_PLACE]
    return None if CONTROL.search(surgery_id) else surgery_id


def deletion(session: Session, surgery_id: str) -> SurgeryDeletedError | None:
    """Return the error of a surgery that was deleted, None for one that was not."""
    try:
        retention.require_present(session, surgery_id)
    except SurgeryDeletedError as error:
        return error
    return None
