"""Turns: no more at once than there are, and the further ones come when those have ended."""

from __future__ import annotations

import asyncio
import threading

import pytest
from anyio import CapacityLimiter
from fastapi import HTTPException

from service import turns
from service.turns import in_turn


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
        limiter = CapacityLimiter(2)
        return await asyncio.gather(*(in_turn(limiter, action, number) for number in range(8)))

    assert asyncio.run(ask()) == list(range(8))
    assert most == 2


def test_an_action_that_fails_gives_its_turn_back() -> None:
    async def ask() -> int:
        limiter = CapacityLimiter(1)
        with pytest.raises(ZeroDivisionError):
            await in_turn(limiter, divmod, 1, 0)
        return await in_turn(limiter, len, "abc")

    assert asyncio.run(ask()) == 3


def test_who_waits_too_long_is_told_to_come_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(turns, "MAX_WAIT_SECONDS", 0.01)

    async def ask() -> HTTPException:
        limiter = CapacityLimiter(1)
        async with limiter:
            with pytest.raises(HTTPException) as error:
                await in_turn(limiter, len, "abc")
        assert await in_turn(limiter, len, "abc") == 3
        return error.value

    error = asyncio.run(ask())
    assert error.status_code == 503
    assert "Retry-After" in (error.headers or {})
