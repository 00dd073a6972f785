"""Turns: no more at once than there are; every route that writes takes one."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator

import pytest
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute

from service.app import _ROUTES
from service.key_turns import KeyTurns
from service.turns import WriteTurn, in_turn


def test_no_more_run_at_once_than_there_are_turns() -> None:
    lock = threading.Lock()
    running, most = 0, 0
    both = threading.Barrier(2)

    def action(number: int) -> int:
        nonlocal running, most
        with lock:
            running += 1
            most = max(most, running)
        both.wait(60)  # only two that run at once come past this
        with lock:
            running -= 1
        return number

    async def ask() -> list[int]:
        turns = KeyTurns(2, 60.0)
        return await asyncio.gather(*(in_turn(turns, "key", action, number) for number in range(8)))

    assert asyncio.run(ask()) == list(range(8))
    assert most == 2


def test_an_action_that_fails_gives_its_turn_back() -> None:
    async def ask() -> int:
        turns = KeyTurns(1, 60.0)
        with pytest.raises(ZeroDivisionError):
            await in_turn(turns, "key", divmod, 1, 0)
        return await in_turn(turns, "key", len, "abc")

    assert asyncio.run(ask()) == 3


ROUTES = [route for resource in _ROUTES for route in resource.router.routes if isinstance(route, APIRoute)]
WITHOUT = {
    "POST /v1/surgeries/{surgery_id}/radiographs/fit": "it stores nothing",
    "POST /v1/surgeries/{surgery_id}/radiographs": "it takes its turn after the radiograph is decoded",
}


def dependencies(dependant: Dependant) -> Iterator[object]:
    for inner in dependant.dependencies:
        yield inner.call
        yield from dependencies(inner)


def test_every_route_that_changes_something_takes_a_turn() -> None:
    changing, without = set(), set()
    for route in ROUTES:
        for method in (route.methods or set()) - {"GET", "HEAD"}:
            changing.add(f"{method} {route.path}")
            if WriteTurn.dependency not in set(dependencies(route.dependant)):
                without.add(f"{method} {route.path}")
    assert without == set(WITHOUT)
    assert without < changing
