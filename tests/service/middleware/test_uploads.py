import asyncio
from typing import Any

import httpx
from starlette.types import Receive, Scope, Send

from service.declared_routes import SCOPE_KEY, DeclaredRoute
from service.middleware.uploads import UploadTurns

FORM = DeclaredRoute("/", frozenset({"POST"}), {}, "multipart/form-data")
JSON = DeclaredRoute("/", frozenset({"POST"}), {}, "application/json")


class Slow:
    """An application that answers when it is let, and counts the bodies that it holds."""

    def __init__(self, total: int, timeout_s: float = 30.0) -> None:
        self.held = self.most = 0
        self.let = asyncio.Event()
        self._turns = UploadTurns(self._answer, total, timeout_s)

    async def _answer(self, scope: Scope, receive: Receive, send: Send) -> None:
        self.held += 1
        self.most = max(self.most, self.held)
        await self.let.wait()
        self.held -= 1
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b""})

    async def send(self, size: int, route: DeclaredRoute = FORM) -> httpx.Response:
        async def app(scope: Scope, receive: Receive, send: Send) -> None:
            await self._turns({**scope, SCOPE_KEY: route}, receive, send)

        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://test") as client:
            return await client.post("/", content=b"x" * size)


async def settle(*tasks: asyncio.Task[Any]) -> None:
    for _ in range(100):
        await asyncio.sleep(0)
    assert tasks


def test_no_more_is_held_at_once_and_all_are_answered() -> None:
    async def scenario() -> None:
        slow = Slow(total=100)
        tasks = [asyncio.create_task(slow.send(40)) for _ in range(7)]
        await settle(*tasks)
        assert slow.held == 2
        slow.let.set()
        assert [answer.status_code for answer in await asyncio.gather(*tasks)] == [200] * 7
        assert slow.most == 2

    asyncio.run(scenario())


def test_one_larger_than_all_takes_all() -> None:
    async def scenario() -> None:
        slow = Slow(total=100)
        tasks = [asyncio.create_task(slow.send(size)) for size in (1_000, 1)]
        await settle(*tasks)
        assert slow.held == 1
        slow.let.set()
        assert [answer.status_code for answer in await asyncio.gather(*tasks)] == [200, 200]

    asyncio.run(scenario())


def test_who_waits_too_long_is_answered_and_hinders_nobody() -> None:
    async def scenario() -> None:
        slow = Slow(total=100, timeout_s=0.05)
        first = asyncio.create_task(slow.send(90))
        await settle(first)
        late = await slow.send(50)
        assert (late.status_code, late.headers["retry-after"]) == (503, "5")
        small = asyncio.create_task(slow.send(10))
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
