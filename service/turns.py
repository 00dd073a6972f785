"""Turns at work that takes much: a few requests at once do it, and further ones wait."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, ParamSpec, TypeVar

from anyio import CapacityLimiter, fail_after, to_thread
from fastapi import Depends, HTTPException, Request

MAX_DECODINGS = 2
"""Radiographs that are decoded at the same time, each in a process of its own."""
MAX_EXPORTS = 2
"""Exports that are made at the same time, each in a process of its own."""
MAX_PLANS = 1
"""Plans that are computed at the same time, in the process of the API."""
MAX_WAIT_SECONDS = 300.0
"""Time that a request waits for its turn."""

Result = TypeVar("Result")
Arguments = ParamSpec("Arguments")


@dataclass(frozen=True)
class Turns:
    """The turns of an application, made in its event loop.

    Attributes
    ----------
    decoding
        Turns at decoding a radiograph.
    exporting
        Turns at making an export.
    planning
        Turns at computing a plan.
    """

    decoding: CapacityLimiter = field(default_factory=lambda: CapacityLimiter(MAX_DECODINGS))
    exporting: CapacityLimiter = field(default_factory=lambda: CapacityLimiter(MAX_EXPORTS))
    planning: CapacityLimiter = field(default_factory=lambda: CapacityLimiter(MAX_PLANS))


async def _turns(request: Request) -> Turns:
    turns: Turns = request.app.state.turns
    return turns


TurnsDep = Annotated[Turns, Depends(_turns)]


async def in_turn(
    turns: CapacityLimiter,
    action: Callable[Arguments, Result],
    *args: Arguments.args,
    **kwargs: Arguments.kwargs,
) -> Result:
    """Wait for a turn, and do something in a thread that is none of those that all requests share.

    Parameters
    ----------
    turns
        The turns.
    action
        What is done.
    *args, **kwargs
        Its arguments.

    Returns
    -------
    object
        What the action returns.

    Raises
    ------
    HTTPException
        503 when no turn came in time.
    """
    request = object()
    try:
        with fail_after(MAX_WAIT_SECONDS):
            await turns.acquire_on_behalf_of(request)
    except TimeoutError as error:
        detail = "too many requests of this kind wait for their turn; send it again"
        raise HTTPException(503, detail, {"Retry-After": "10"}) from error
    try:
        return await to_thread.run_sync(lambda: action(*args, **kwargs), limiter=CapacityLimiter(1))
    finally:
        turns.release_on_behalf_of(request)
