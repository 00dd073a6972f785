"""Changes as a stream of server-sent events, for dashboards."""

from __future__ import annotations

from collections.abc import AsyncIterator
from time import monotonic
from typing import Annotated

from fastapi import APIRouter, Header, Query, Request
from fastapi.sse import EventSourceResponse, ServerSentEvent

from service.dependencies import AdmissionDep, problems
from service.middleware.head import HEAD_KEY
from service.routes.changes import MAX_NUMBER, SurgeryFilter
from service.watch import StreamPlace, WatchDep

router = APIRouter(prefix="/v1/events", tags=["changes"])

_RETRY_MS = 1000
_LOOK_S = 60.0


@router.get("", response_class=EventSourceResponse, responses=problems(422), dependencies=[StreamPlace])
async def stream_events(
    request: Request,
    watch: WatchDep,
    admission: AdmissionDep,
    since: Annotated[
        int | None,
        Query(
            ge=0,
            le=MAX_NUMBER,
            description="Number of the last change that is known; by default the latest one.",
        ),
    ] = None,
    surgery_id: SurgeryFilter = None,
    last_event_id: Annotated[
        int | None,
        Header(
            ge=0, le=MAX_NUMBER, description="Sent by browsers that connect again; counts before `since`."
        ),
    ] = None,
) -> AsyncIterator[ServerSentEvent]:
    """Stream the changes as they are committed; the id of each event is the number of the change.

    The first event has no data: its id is where the stream begins. A comment comes every 15 seconds when nothing else
    does. The stream ends when the service stops and after some time, an hour by default, and may be taken up where it
    ended. It also ends within some seconds when the key of the client is revoked or expires, or its session ends.
    """
    if request.scope.get(HEAD_KEY):
        return
    async with watch.looking(admission):
        position = last_event_id if last_event_id is not None else since
        if position is None:
            position = await watch.latest()
        yield ServerSentEvent(comment="open", id=str(position), retry=_RETRY_MS)
        end = monotonic() + watch.stream_seconds
        while monotonic() < end and not (watch.stopping or watch.is_withdrawn(admission)):
            found = await watch.changes_after(position)
            for change in found.changes:
                if surgery_id in {None, change.surgery_id}:
                    yield ServerSentEvent(raw_data=change.model_dump_json(), id=str(change.seq))
            position = found.last
            if found.done:
                await watch.next_look(min(_LOOK_S, end - monotonic()))
