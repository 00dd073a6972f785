"""Health of the service."""

from __future__ import annotations

from importlib.metadata import version
from typing import Annotated, Literal

from fastapi import APIRouter
from pydantic import Field

from contract.base import Schema
from service.dependencies import DatabaseDep, problems
from store.revision import REVISION, require_revision

router = APIRouter(prefix="/v1/health", tags=["health"])


class Health(Schema):
    """The service runs, and its database is available and has the tables of this version."""

    status: Annotated[Literal["ready"], Field(description="Always ready; otherwise the answer is a problem.")]
    version: Annotated[str, Field(description="Version of Spinewatch.")]
    revision: Annotated[str, Field(description="Revision of the database's tables.")]


@router.get("", responses=problems())
def get_health(database: DatabaseDep) -> Health:
    """Get the health of the service; 503 unless the database is available and has the tables of this version."""
    require_revision(database)
    return Health(status="ready", version=version("spinewatch"), revision=REVISION)
