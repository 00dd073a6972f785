"""Health: whether the service can do its work."""

from __future__ import annotations

from importlib.metadata import version
from typing import Literal

from fastapi import APIRouter

from contract.base import Schema
from service.dependencies import TheDatabase, problems
from store.revision import REVISION, require_revision

router = APIRouter(prefix="/v1/health", tags=["health"])


class HealthDocument(Schema):
    """The service answers, reaches its database, and finds the tables that it works with."""

    status: Literal["ready"]
    version: str
    revision: str


@router.get("", responses=problems())
def get_health(record: TheDatabase) -> HealthDocument:
    """Tell whether the service is ready; 503 when the database is not."""
    require_revision(record)
    return HealthDocument(status="ready", version=version("spinewatch"), revision=REVISION)
