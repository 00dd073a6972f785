"""Turns at writing: few at once, one of each key after the other, a bounded wait, on every route that writes."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator

import pytest
from fastapi.dependencies.models import Dependant
from fastapi.routing import APIRoute

from service import write_turns
from service.app import _ROUTES
from service.problems import TooManyWritesError
from service.write_turns import WriteTurns

ROUTES = [route for resource in _ROUTES for route in resource.router.routes if isinstance(route, APIRoute)]
WITHOUT = {
    "POST /v1/surgeries/{surgery_id}/radiographs/fit": "it stores nothing",
    "POST /v1/surgeries/{surgery_id}/radiographs": "it takes its turn after the radiograph is decoded",
}


async def wait(turns: WriteTurns, key: str, done: list[str]) -> None:
    async with turns.turn(key):
        done.append(key)


async def queued(turns: WriteTurns, keys: str, done: list[str]) -> list[asyncio.Task[None]]:
    """Return tasks that wait for a turn in this order, each of the key that a letter names."""
    tasks = []
    for key in keys:
        tasks.append(asyncio.create_task(wait(turns, key, done)))
        await asyncio.sleep(0)
    return tasks


def test_no_more_write_at_once_than_there_are_places() -> None:
    async def scenario() -> int:
        turns, running, most = WriteTurns(places=3), 0, 0

        async def write(number: int) -> None:
            nonlocal running, most
            async with turns.turn(str(number % 2)):
                running += 1
                most = max(most, running)
                await asyncio.sleep(0)
                running -= 1

        await asyncio.gather(*map(write, range(20)))
        return most

    assert asyncio.run(scenario()) == 3


def test_the_many_requests_of_a_key_do_not_delay_one_of_another() -> None:
    async def scenario() -> str:
        turns, done = WriteTurns(places=1), list[str]()
        async with turns.turn("a"):
            tasks = await queued(turns, "aaaaabbc", done)
        await asyncio.gather(*tasks)
        return "".join(done)

    assert asyncio.run(scenario()) == "abcabaaa"


def test_who_waits_too_long_is_told_so_and_keeps_no_place() -> None:
    async def scenario() -> None:
        turns, done = WriteTurns(places=1, wait_s=0.01), list[str]()
        async with turns.turn("a"):
            with pytest.raises(TooManyWritesError, match="send it again"):
                await wait(turns, "b", done)
        await wait(turns, "a", done)
        assert done == ["a"]
        assert not turns._waiting

    asyncio.run(scenario())


def test_a_client_that_leaves_gives_its_place_to_the_next() -> None:
    async def scenario() -> None:
        turns, done = WriteTurns(places=1), list[str]()
        async with turns.turn("a"):
            first, second, third = await queued(turns, "bcd", done)
            second.cancel()
        first.cancel()  # its turn has just come
        await third
        assert done == ["d"]
        async with asyncio.timeout(20), turns.turn("a"):
            pass

    asyncio.run(scenario())


def test_an_error_gives_the_turn_back() -> None:
    async def scenario() -> None:
        turns = WriteTurns(places=1)
        with pytest.raises(ZeroDivisionError):
            async with turns.turn("a"):
                raise ZeroDivisionError
        async with asyncio.timeout(20), turns.turn("a"):
            pass

    asyncio.run(scenario())


def dependencies(dependant: Dependant) -> Iterator[object]:
    for inner in dependant.dependencies:
        yield inner.call
        yield from dependencies(inner)


def test_every_route_that_changes_something_takes_a_turn() -> None:
    changing = [route for route in ROUTES if not route.methods <= {"GET", "HEAD"}]
    without = set()
    for route in changing:
        if write_turns.WriteTurn.dependency not in set(dependencies(route.dependant)):
            without.add(f"{next(iter(route.methods))} {route.path}")
    assert without == set(WITHOUT)
    assert len(without) < len(changing)
