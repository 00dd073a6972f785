import asyncio
from collections.abc import AsyncIterator
from typing import Any

import httpx
import pytest
from starlette.types import Receive, Scope, Send

from service.access import PRINCIPAL, Principal
from service.declared_routes import SCOPE_KEY, DeclaredRoute
from service.middleware.uploads import UploadTurns

FORM = DeclaredRoute("/", frozenset({"POST"}), {}, "multipart/form-data")
JSON = DeclaredRoute("/", frozenset({"POST"}), {}, "application/json")


class Slow:
    """An application that answers when it is let, and counts the bodies that it holds."""

    def __init__(self, total: int, timeout_s: float = 30.0, largest: int = 100) -> None:
        self.held = self.most = 0
        self.let = asyncio.Event()
        self._turns = UploadTurns(self._answer, total, largest, timeout_s)

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        self.held += 1
        self.most = max(self.most, self.held)
        await self.let.wait()
        self.held -= 1
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    async def send(
        self, size: int, route: DeclaredRoute = FORM, key: str = "cart", has_length: bool = True
    ) -> httpx.Response:
        principal = Principal(key, key, frozenset(), None, None)

        async def app(scope: Scope, receive: Receive, send: Send) -> None:
            await self._turns({**scope, SCOPE_KEY: route, "state": {PRINCIPAL: principal}}, receive, send)

        async def body() -> AsyncIterator[bytes]:
            yield b"x" * size

        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://test") as client:
            return await client.post("/", content=b"x" * size if has_length else body())


async def settle(*tasks: asyncio.Task[Any]) -> None:
    for _ in range(100):
        await asyncio.sleep(0)
    assert tasks


def test_no_more_is_held_at_once_and_all_are_answered() -> None:
    async def scenario() -> None:
        slow = Slow(total=100)
        tasks = [asyncio.create_task(slow.send(30)) for _ in range(7)]
        await settle(*tasks)
        assert slow.held == 2
        slow.let.set()
        assert [answer.status_code for answer in await asyncio.gather(*tasks)] == [200] * 7
        assert slow.most == 2

    asyncio.run(scenario())


def test_one_larger_than_all_is_read_too() -> None:
    async def scenario() -> None:
        slow = Slow(total=100)
        tasks = [asyncio.create_task(slow.send(size)) for size in (1_000, 60)]
        await settle(*tasks)
        assert slow.held == 1
        slow.let.set()
        assert [answer.status_code for answer in await asyncio.gather(*tasks)] == [200, 200]

    asyncio.run(scenario())


@pytest.mark.parametrize("has_length", [True, False])
def test_small_forms_pass_large_ones(has_length: bool) -> None:
    """Whatever large forms are being read or wait, those that fit do not wait for them."""

    async def scenario() -> None:
        slow = Slow(total=200)
        large = [asyncio.create_task(slow.send(100, has_length=has_length)) for _ in range(4)]
        await settle(*large)
        assert slow.held == 1
        small = [asyncio.create_task(slow.send(6)) for _ in range(8)]
        await settle(*small)
        assert slow.held == 9
        slow.let.set()
        assert {answer.status_code for answer in await asyncio.gather(*large, *small)} == {200}

    asyncio.run(scenario())


def test_one_key_leaves_room_for_others() -> None:
    async def scenario() -> None:
        slow = Slow(total=320)
        own = [asyncio.create_task(slow.send(10)) for _ in range(40)]
        await settle(*own)
        assert slow.held == 24
        others = [asyncio.create_task(slow.send(10, key="another")) for _ in range(8)]
        await settle(*others)
        assert slow.held == 32
        slow.let.set()
        assert {answer.status_code for answer in await asyncio.gather(*own, *others)} == {200}

    asyncio.run(scenario())


def test_who_waits_too_long_is_answered_and_hinders_nobody() -> None:
    async def scenario() -> None:
        slow = Slow(total=100, timeout_s=0.05)
        first = asyncio.create_task(slow.send(70))
        await settle(first)
        late = await slow.send(50)
        assert (late.status_code, late.headers["retry-after"]) == (503, "5")
        small = asyncio.create_task(slow.send(3))
        await settle(small)
        assert slow.held == 2
        slow.let.set()
        assert (await first).status_code == (await small).status_code == 200

    asyncio.run(scenario())


def test_other_bodies_do_not_wait() -> None:
    async def scenario() -> None:
        slow = Slow(total=10)
        tasks = [asyncio.create_task(slow.send(10, JSON)) for _ in range(5)]
        await settle(*tasks)
        assert slow.held == 5
        slow.let.set()
        await asyncio.gather(*tasks)

    asyncio.run(scenario())
