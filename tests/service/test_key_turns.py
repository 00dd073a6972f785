"""Turns: few at once, one of each key after the other, a bounded wait."""

from __future__ import annotations

import asyncio

import pytest

from service.key_turns import KeyTurns, TooBusyError

WAIT_S = 60.0


async def wait(turns: KeyTurns, key: str, done: list[str]) -> None:
    async with turns.turn(key):
        done.append(key)


async def queued(turns: KeyTurns, keys: str, done: list[str]) -> list[asyncio.Task[None]]:
    """Return tasks that wait for a turn in this order, each of the key that a letter names."""
    tasks = []
    for key in keys:
        tasks.append(asyncio.create_task(wait(turns, key, done)))
        await asyncio.sleep(0)
    return tasks


def test_no_more_have_a_turn_at_once_than_there_are_places() -> None:
    async def scenario() -> int:
        turns, running, most = KeyTurns(3, WAIT_S), 0, 0

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
        turns, done = KeyTurns(1, WAIT_S), list[str]()
        async with turns.turn("a"):
            tasks = await queued(turns, "aaaaabbc", done)
        await asyncio.gather(*tasks)
        return "".join(done)

    assert asyncio.run(scenario()) == "abcabaaa"


def test_who_waits_too_long_is_told_so_and_keeps_no_place() -> None:
    async def scenario() -> None:
        turns, done = KeyTurns(1, wait_s=0.01), list[str]()
        async with turns.turn("a"):
            with pytest.raises(TooBusyError, match="send it again"):
                await wait(turns, "b", done)
        await wait(turns, "a", done)
        assert done == ["a"]
        assert not turns._waiting

    asyncio.run(scenario())


def test_a_client_that_leaves_gives_its_place_to_the_next() -> None:
    async def scenario() -> None:
        turns, done = KeyTurns(1, WAIT_S), list[str]()
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
        turns = KeyTurns(1, WAIT_S)
        with pytest.raises(ZeroDivisionError):
            async with turns.turn("a"):
                raise ZeroDivisionError
        async with asyncio.timeout(20), turns.turn("a"):
            pass

    asyncio.run(scenario())
