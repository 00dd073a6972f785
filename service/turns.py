"""Turns at work that takes much: a few requests at once do it, and further ones wait."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field
from typing import Annotated, ParamSpec, TypeVar

from anyio import CapacityLimiter, to_thread
from fastapi import Depends, Request

from service.dependencies import AdmissionDep
from service.key_turns import KeyTurns

MAX_DECODINGS = 2
"""Radiographs that are decoded at the same time, each in a process of its own."""
MAX_EXPORTS = 2
"""Exports that are made at the same time, each in a process of its own."""
MAX_PLANS = 1
"""Plans that are computed at the same time, in the process of the API."""
MAX_WAIT_SECONDS = 300.0
"""Time that a request waits for its turn at one of these."""
MAX_WRITERS = 4
"""Requests that write at the same time: the database lets one of them write, the others prepare what they write.

Measured with 60 clients that write without pause, on two cores: reads take twice as long with 8, and with 1 fewer
requests are answered; without turns, reads wait for the writers, 5 to 9 s."""
MAX_WRITE_WAIT_SECONDS = 10.0
"""Time that a request waits for its turn at writing, which is that of a transaction for the database."""

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
    writing
        Turns at writing to the database: threads and connections are left for requests that read.
    """

    decoding: KeyTurns = field(default_factory=lambda: KeyTurns(MAX_DECODINGS, MAX_WAIT_SECONDS))
    exporting: KeyTurns = field(default_factory=lambda: KeyTurns(MAX_EXPORTS, MAX_WAIT_SECONDS))
    planning: KeyTurns = field(default_factory=lambda: KeyTurns(MAX_PLANS, MAX_WAIT_SECONDS))
    writing: KeyTurns = field(default_factory=lambda: KeyTurns(MAX_WRITERS, MAX_WRITE_WAIT_SECONDS))


async def _turns(request: Request) -> Turns:
    turns: Turns = request.app.state.turns
    return turns


TurnsDep = Annotated[Turns, Depends(_turns)]


async def _turn_at_writing(turns: TurnsDep, admission: AdmissionDep) -> AsyncIterator[None]:
    async with turns.writing.turn(admission.key_prefix):
        yield


WriteTurn = Depends(_turn_at_writing, scope="function")
"""A dependency of routes that write: a turn that is kept until the route has ended, not until its answer is read."""


async def in_turn(
    turns: KeyTurns,
    key: str,
    action: Callable[Arguments, Result],
    *args: Arguments.args,
    **kwargs: Arguments.kwargs,
) -> Result:
    """Wait for a turn, and do something in a thread that is none of those that all requests share.

    Parameters
    ----------
    turns
        The turns.
    key
        Prefix of the key of the request.
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
    TooBusyError
        No turn came in time.
    """
    async with turns.turn(key):
        return await to_thread.run_sync(lambda: action(*args, **kwargs), limiter=CapacityLimiter(1))
