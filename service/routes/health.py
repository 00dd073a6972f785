"""Health of the service: whether it lives, and whether it is ready for work."""

from __future__ import annotations

from importlib.metadata import version
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Request, Response

from contract.health import Health, Liveness, NotReady, Readiness
from service.dependencies import DatabaseDep, KnownDep, problems
from service.problems import problem, problem_response
from service.readiness import ReadinessChecks
from store.revision import REVISION, require_revision

_VERSION = version("spinewatch")

router = APIRouter(tags=["health"])

_RETRY_SECONDS = 5
_NOT_READY: dict[int | str, dict[str, Any]] = {
    **problems(),
    503: {"model": NotReady, "description": "Not ready; detail and checks have the reason"},
}


async def _instance(request: Request) -> str:
    instance: str = request.app.state.instance
    return instance


async def _readiness(request: Request) -> ReadinessChecks:
    checks: ReadinessChecks = request.app.state.readiness
    return checks


InstanceDep = Annotated[str, Depends(_instance)]
ReadinessDep = Annotated[ReadinessChecks, Depends(_readiness)]


@router.get("/v1/health", responses=problems())
def get_health(database: DatabaseDep, known: KnownDep) -> Health:
    """Get whether the server answers; with an API key 503 unless the database has the tables of this version."""
    if not known:
        return Health(status="live", version=_VERSION)
    require_revision(database)
    return Health(status="ready", version=_VERSION, revision=REVISION)


@router.get("/health/live")
async def get_liveness(instance: InstanceDep) -> Liveness:
    """Get whether the server answers requests; nothing else is asked, so that it answers while the database cannot."""
    return Liveness(status="live", instance=instance, version=_VERSION)


@router.get("/health/ready", responses=_NOT_READY, response_model=Readiness)
async def get_readiness(
    request: Request, instance: InstanceDep, readiness: ReadinessDep
) -> Readiness | Response:
    """Get whether the service can do its work: the database, free space, the queue and workers; 503 if not."""
    checks = await readiness.results()
    failed = [check for check in checks if not check.ok]
    if not failed:
        return Readiness(
            status="ready", instance=instance, version=_VERSION, revision=REVISION, checks=checks
        )
    reasons = "; ".join(f"{check.name}: {check.detail}" for check in failed)
    not_ready = problem(503, f"the service is not ready: {reasons}", "not-ready")
    answer = NotReady(**not_ready.model_dump(), checks=checks)
    return problem_response(request.scope, answer, {"Retry-After": str(_RETRY_SECONDS)})
