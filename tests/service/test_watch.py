import asyncio
from collections.abc import Callable, Coroutine, Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

from service import watch as watch_module
from service.problems import AccessEndedError, TooManyWaitingError
from service.watch import Watch
from store import jobs, keys
from store.admissions import Admission
from store.database import Database
from store.tables.access import ApiKey
from tests.backends import new_database
from tests.store.builders import CLIENT, NOON, new_stage, new_surgery

PATIENCE_S = 30
CART = Admission("cart", None)


@pytest.fixture
def database(tmp_path: Path) -> Iterator[Database]:
    with new_database(tmp_path) as url:
        database = Database(url)
        with database.write() as session:
            session.add(ApiKey(prefix="cart", key_sha256="0" * 64, name="cart", scopes=[], created_at=NOON))
        yield database
        database.close()


def run(database: Database, scenario: Callable[[Watch, asyncio.Event], Coroutine[Any, Any, None]]) -> None:
    async def main() -> None:
        stopping = asyncio.Event()
        await asyncio.wait_for(scenario(Watch(database, stopping), stopping), PATIENCE_S)

    asyncio.run(main())


async def until_looking(watch: Watch) -> None:
    """Wait for the first look, from which on changes come from memory."""
    while watch._last is None:
        await asyncio.sleep(0.01)


def test_those_who_wait_wake_with_a_change(database: Database) -> None:
    async def scenario(watch: Watch, _: asyncio.Event) -> None:
        async def follow() -> list[str]:
            async with watch.looking(CART):
                found: list[str] = []
                position = await watch.latest()
                while not found:
                    await watch.next_look(PATIENCE_S)
                    changes = await watch.changes_after(position)
                    position, found = changes.last, [change.id for change in changes.changes]
            return found

        tasks = [asyncio.create_task(follow()) for _ in range(3)]
        await until_looking(watch)
        surgery = await asyncio.to_thread(new_surgery, database)
        assert await asyncio.gather(*tasks) == [[surgery]] * 3

    run(database, scenario)


def test_older_changes_come_from_the_database(database: Database) -> None:
    made = [new_surgery(database) for _ in range(3)]

    async def scenario(watch: Watch, _: asyncio.Event) -> None:
        async with watch.looking(CART):
            await until_looking(watch)
            found = await watch.changes_after(0)
            assert [change.id for change in found.changes] == made
            assert (await watch.changes_after(found.last)).changes == []

    run(database, scenario)


def test_memory_forgets_the_oldest_changes_and_none_is_missed(
    database: Database, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(watch_module, "_KEPT", 2)

    async def scenario(watch: Watch, _: asyncio.Event) -> None:
        async with watch.looking(CART):
            await until_looking(watch)
            start = await watch.latest()
            made = [await asyncio.to_thread(new_surgery, database) for _ in range(5)]
            found: list[str] = []
            position = start
            while len(found) < len(made):
                changes = await watch.changes_after(position)
                found += [change.id for change in changes.changes]
                position = changes.last
                if changes.done:
                    await watch.next_look(1)
            assert found == made

    run(database, scenario)


def test_the_end_of_a_job_is_waited_for(database: Database) -> None:
    job = new_stage(database, new_surgery(database)).job.id

    def cancel() -> None:
        with database.write() as session:
            jobs.cancel(session, job, NOON, CLIENT)

    async def scenario(watch: Watch, _: asyncio.Event) -> None:
        waiting = asyncio.create_task(watch.job_end(job, PATIENCE_S, CART))
        await until_looking(watch)
        await watch.job_end(job, 0.3, CART)
        assert not waiting.done()
        await asyncio.to_thread(cancel)
        await waiting

    run(database, scenario)


def test_a_key_has_so_many_places_and_no_more(database: Database) -> None:
    async def scenario(watch: Watch, _: asyncio.Event) -> None:
        with ExitStack() as places:
            for number in range(watch_module.MAX_WAITING):
                places.enter_context(watch.place(Admission("cart", f"session {number}")))
            with pytest.raises(TooManyWaitingError, match="cart"), watch.place(CART):
                pass
            with pytest.raises(TooManyWaitingError):
                await watch.job_end("job", PATIENCE_S, CART)
            with watch.place(Admission("another", None)):
                pass
        with watch.place(CART):
            pass

    run(database, scenario)


def test_waiting_ends_when_the_service_stops(database: Database) -> None:
    async def scenario(watch: Watch, stopping: asyncio.Event) -> None:
        waiting = asyncio.create_task(watch.job_end("none", PATIENCE_S, CART))
        await until_looking(watch)
        stopping.set()
        await waiting
        assert watch.stopping

    run(database, scenario)


def test_waiting_ends_with_the_admission(database: Database) -> None:
    def revoke() -> None:
        with database.write() as session:
            keys.revoke(session, "cart", NOON, CLIENT)

    async def scenario(watch: Watch, _: asyncio.Event) -> None:
        async with watch.looking(CART):
            waiting = asyncio.create_task(watch.job_end("none", PATIENCE_S, CART))
            await until_looking(watch)
            assert not watch.is_withdrawn(CART)
            await asyncio.to_thread(revoke)
            with pytest.raises(AccessEndedError, match="send a valid key"):
                await waiting
            assert watch.is_withdrawn(CART)

    run(database, scenario)


def test_nobody_looks_when_nobody_waits(database: Database) -> None:
    async def scenario(watch: Watch, _: asyncio.Event) -> None:
        async with watch.looking(CART):
            await until_looking(watch)
        while watch._task is not None:
            await asyncio.sleep(0.01)
        async with watch.looking(CART):
            assert watch._task is not None

    run(database, scenario)
