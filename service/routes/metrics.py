"""Metrics for Prometheus."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.dependencies import problems
from service.metrics import MEDIA_TYPE, Metrics

router = APIRouter(tags=["health"])

_TEXT = {
    "description": "Metrics in the text format of Prometheus",
    "content": {"text/plain": {"schema": {"type": "string"}}},
}


@router.get("/metrics", response_class=Response, responses={**problems(), 200: _TEXT})
async def get_metrics(request: Request) -> Response:
    """Get requests, queue, jobs, times of steps, workers, free space and drift of calibrations, for Prometheus."""
    metrics: Metrics = request.app.state.metrics
    return Response(await metrics.text(), media_type=MEDIA_TYPE)
