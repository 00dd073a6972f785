"""The stream of changes, for dashboards."""

import json
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from datetime import timedelta
from pathlib import Path
from queue import Empty, Queue
from typing import Any

import httpx
import pytest

from contract.event import Actor, ActorKind
from contract.key import NewKey, Scope
from service.watch import MAX_WAITING
from store import keys
from store.clock import utc_now
from store.database import Database
from tests.http.harness import Service, code_of, pair, wait_for
from tests.patience import PATIENCE_S

Event = dict[str, str]


class Stream:
    """A client of the stream; a thread reads its events."""

    def __init__(self, service: Service, client: httpx.Client | None = None, **request: Any) -> None:
        self._queue: Queue[Event | None] = Queue()
        headers = {**service.client.headers, **request.pop("headers", {})}
        self._client = client or httpx.Client(
            base_url=service.client.base_url, headers=headers, timeout=60, trust_env=False
        )
        self._request = request
        self._opened = threading.Event()
        self._thread = threading.Thread(target=self._read, daemon=True)

    def __enter__(self) -> "Stream":
        self._thread.start()
        assert self._opened.wait(PATIENCE_S)
        return self

    def __exit__(self, *_: object) -> None:
        self._response.close()
        self._client.close()

    def _read(self) -> None:
        try:
            with self._client.stream("GET", "/v1/events", **self._request) as self._response:
                self.status, self.headers = self._response.status_code, self._response.headers
                fields: Event = {}
                for line in self._response.iter_lines():
                    if line:
                        name, _, value = line.partition(":")
                        fields[name or "comment"] = value.strip()
                        continue
                    self._queue.put(fields)
                    self._opened.set()
                    fields = {}
        except httpx.HTTPError:
            pass
        finally:
            self._opened.set()
            self._queue.put(None)

    def next(self) -> Event | None:
        """Return the next event, None at the end of the stream."""
        return self._queue.get(timeout=PATIENCE_S)

    def change(self) -> dict[str, Any]:
        """Return the next change; the first event and comments are passed over."""
        while True:
            event = self.next()
            assert event is not None
            if "data" in event:
                document: dict[str, Any] = json.loads(event["data"])
                assert event["id"] == str(document["seq"])
                return document

    def ends(self) -> bool:
        """Wait for the end of the stream; whether there were changes before it does not matter."""
        while self.next() is not None:
            pass
        return True

    def is_silent(self) -> bool:
        try:
            return "data" not in (self._queue.get(timeout=0.5) or {})
        except Empty:
            return True


@contextmanager
def following(service: Service, **request: Any) -> Iterator[Stream]:
    with Stream(service, **request) as stream:
        yield stream


def test_changes_arrive_as_they_are_committed(service: Service, calibration: str) -> None:
    with following(service) as stream:
        assert stream.headers["content-type"].startswith("text/event-stream")
        surgery = service.surgery()
        assert stream.change()["id"] == surgery
        service.submit(surgery, "PRE", pair("PRE"), calibration)
        actions = [stream.change()["action"] for _ in range(3)]
    assert actions == ["stage:submitted", "job:started", "stage:measured"]


def test_a_stream_wakes_soon(idle: Service) -> None:
    """Of several changes the median is taken: a busy machine may delay some."""
    delays = []
    with following(idle) as stream:
        for _ in range(7):
            idle.surgery()
            committed = time.monotonic()
            stream.change()
            delays.append(time.monotonic() - committed)
    assert sorted(delays)[3] < 1.0


def test_a_stream_is_taken_up_where_it_ended(idle: Service) -> None:
    with following(idle) as stream:
        first = idle.surgery()
        seen = stream.change()
        assert seen["id"] == first
    missed = [idle.surgery() for _ in range(3)]
    with following(idle, headers={"Last-Event-ID": str(seen["seq"])}) as stream:
        assert [stream.change()["id"] for _ in missed] == missed
        latest = idle.surgery()
        assert stream.change()["id"] == latest
    with following(idle, params={"since": seen["seq"]}) as stream:
        assert [stream.change()["id"] for _ in (*missed, latest)] == [*missed, latest]


def test_the_first_event_says_where_the_stream_begins(idle: Service) -> None:
    idle.surgery()
    last = idle.client.get("/v1/changes", params={"since": 2**53 - 1}).json()["last"]
    with following(idle) as stream:
        first = stream.next()
    assert first is not None
    assert int(first["id"]) >= last
    assert "data" not in first


def test_only_the_changes_of_a_surgery(idle: Service) -> None:
    surgery = idle.surgery()
    with following(idle, params={"surgery_id": surgery}) as stream:
        idle.surgery()
        job = idle.submit(surgery, "PRE", pair("PRE"), idle.calibration())
        assert stream.change()["action"] == "stage:submitted"
        idle.surgery()
        idle.client.post(f"/v1/jobs/{job}/cancel")
        assert stream.change()["action"] == "job:cancelled"
        assert stream.is_silent()


def test_several_streams_have_the_same_changes(idle: Service) -> None:
    with following(idle) as one, following(idle) as other:
        made = [idle.surgery() for _ in range(5)]
        assert [one.change()["id"] for _ in made] == [other.change()["id"] for _ in made] == made


@pytest.mark.parametrize("position", ["-1", "x", "9007199254740993"])
def test_a_position_that_is_none_is_refused(idle: Service, position: str) -> None:
    answer = idle.client.get("/v1/events", headers={"Last-Event-ID": position})
    assert code_of(answer, 422) == "invalid-request"


def test_the_headers_alone_may_be_asked_for(idle: Service) -> None:
    answer = idle.client.head("/v1/events")
    assert (answer.status_code, answer.content) == (200, b"")


def test_a_stream_ends_in_time_and_is_taken_up(tmp_path: Path) -> None:
    with Service(tmp_path, SPINEWATCH_STREAM_SECONDS="1") as service:
        surgery = service.surgery()
        for since, expected in ((0, [surgery]), (2**53 - 1, [])):
            with following(service, params={"since": since}) as stream:
                events = iter(stream.next, None)
                assert [
                    json.loads(event["data"])["id"] for event in events if event and "data" in event
                ] == expected


def bearer(key: str) -> dict[str, str]:
    return {"authorization": f"Bearer {key}"}


def revoke(service: Service, key: str) -> None:
    prefix = service.client.get("/v1/session", headers=bearer(key)).json()["key"]
    assert service.client.delete(f"/v1/keys/{prefix}").status_code == 200


def test_a_stream_ends_when_its_key_is_revoked(idle: Service) -> None:
    key = idle.make_key(Scope.STAGE_READ)
    with following(idle, headers=bearer(key)) as stream, following(idle) as other:
        surgery = idle.surgery()
        assert stream.change()["id"] == other.change()["id"] == surgery
        revoke(idle, key)
        assert stream.ends()
        surgery = idle.surgery()
        assert other.change()["id"] == surgery
    assert code_of(idle.client.get("/v1/events", headers=bearer(key)), 401) == "key-invalid"


def test_a_stream_ends_with_its_session(idle: Service) -> None:
    opened = idle.client.post("/v1/session")
    cookie = opened.headers["Set-Cookie"].partition(";")[0]
    browser = {"cookie": cookie, "sec-fetch-site": "same-origin"}
    with (
        httpx.Client(base_url=idle.client.base_url, headers=browser, timeout=60, trust_env=False) as client,
        Stream(idle, client=client) as stream,
        following(idle) as other,
    ):
        surgery = idle.surgery()
        assert stream.change()["id"] == surgery
        assert client.delete("/v1/session").status_code == 204
        assert stream.ends()
        assert other.change()["id"] == surgery


def test_a_stream_ends_when_its_key_expires(idle: Service) -> None:
    new = NewKey(name="short", scopes=[Scope.STAGE_READ], expires_in_days=1)
    made_at = utc_now() - timedelta(days=1) + timedelta(seconds=4)
    database = Database(idle.database_url)
    with database.write() as session:
        key = keys.add(session, new, made_at, Actor(kind=ActorKind.COMMAND, name="test"))[1]
    database.close()
    with following(idle, headers=bearer(key)) as stream:
        assert stream.status == 200
        assert stream.ends()


def test_waiting_for_a_job_ends_when_the_key_is_revoked(idle: Service) -> None:
    job = idle.submit(idle.surgery(), "PRE", pair("PRE"), idle.calibration())
    key = idle.make_key(Scope.STAGE_READ)
    with ThreadPoolExecutor(1) as pool, following(idle, headers=bearer(key)) as stream:
        waiting = pool.submit(idle.client.get, f"/v1/jobs/{job}?wait=60", headers=bearer(key))
        time.sleep(0.5)  # so that it waits; if it comes later, it is refused at once
        revoke(idle, key)
        assert stream.ends()
        answer = waiting.result(PATIENCE_S)
    assert code_of(answer, 401) in {"access-ended", "key-invalid"}
    assert "WWW-Authenticate" in answer.headers


def test_a_key_has_so_many_streams_and_waiting_requests_and_no_more(idle: Service) -> None:
    """Others are answered meanwhile, and an ended stream makes room for another."""
    headers = {"Authorization": f"Bearer {idle.make_key(Scope.STAGE_READ)}"}
    job = idle.submit(idle.surgery(), "PRE", pair("PRE"), idle.calibration())
    with ExitStack() as streams, httpx.Client(base_url=idle.client.base_url, headers=headers) as viewer:
        first = viewer.stream("GET", "/v1/events", timeout=PATIENCE_S)
        assert first.__enter__().status_code == 200
        for _ in range(MAX_WAITING - 1):
            stream = streams.enter_context(viewer.stream("GET", "/v1/events", timeout=PATIENCE_S))
            assert stream.status_code == 200
        for path in ("/v1/events", f"/v1/jobs/{job}?wait=60"):
            refused = viewer.get(path, timeout=PATIENCE_S)
            assert code_of(refused, 429) == "too-many-waiting"
            assert int(refused.headers["retry-after"]) > 0
        assert viewer.get(f"/v1/jobs/{job}", timeout=PATIENCE_S).status_code == 200
        with idle.client.stream("GET", "/v1/events") as another:
            assert another.status_code == 200
        first.__exit__(None, None, None)

        def has_room() -> bool:
            with viewer.stream("GET", "/v1/events", timeout=PATIENCE_S) as stream:
                return stream.status_code == 200

        wait_for(has_room, "the place of the stream that has ended")


def test_streams_end_when_the_service_stops(tmp_path: Path) -> None:
    with Service(tmp_path) as service, following(service) as stream:
        service.surgery()
        stream.change()
        service.server.terminate()
        assert stream.ends()
        service.server.wait(20)
