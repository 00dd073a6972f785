import asyncio
import threading
import time
from collections.abc import Iterator

import pytest

from service.shared_run import SharedRun


def test_all_that_ask_together_share_one_run() -> None:
    started, go_on = threading.Event(), threading.Event()
    runs: list[int] = []

    def action() -> int:
        runs.append(1)
        started.set()
        go_on.wait(30)
        return len(runs)

    async def ask() -> list[int]:
        shared = SharedRun(action, kept_seconds=60)
        waiting = [asyncio.create_task(shared.result()) for _ in range(100)]
        await asyncio.to_thread(started.wait, 30)
        go_on.set()
        return [*await asyncio.gather(*waiting), await shared.result()]

    assert asyncio.run(ask()) == [1] * 101


def test_an_old_result_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: now[0])
    runs: list[float] = []

    async def ask() -> None:
        shared = SharedRun(lambda: runs.append(now[0]), kept_seconds=1)
        for at in (0.0, 0.5, 2.0, 2.5):
            now[0] = at
            run = asyncio.ensure_future(shared.result())
            await run

    asyncio.run(ask())
    assert runs == [0.0, 2.0]


def test_one_that_stops_asking_does_not_stop_the_others() -> None:
    go_on = threading.Event()

    async def ask() -> int:
        shared = SharedRun(lambda: 7 if go_on.wait(30) else 0, kept_seconds=0)
        first, second = (asyncio.create_task(shared.result()) for _ in range(2))
        await asyncio.sleep(0)
        first.cancel()
        await asyncio.sleep(0)
        go_on.set()
        return await second

    assert asyncio.run(ask()) == 7


def test_a_failure_is_raised_to_all_and_the_next_run_may_succeed() -> None:
    answers: Iterator[ValueError | int] = iter([ValueError("broken"), 1])

    def action() -> int:
        answer = next(answers)
        if isinstance(answer, ValueError):
            raise answer
        return answer

    async def ask() -> int:
        shared = SharedRun(action, kept_seconds=-1)
        with pytest.raises(ValueError, match="broken"):
            await shared.result()
        return await shared.result()

    assert asyncio.run(ask()) == 1
