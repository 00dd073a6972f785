"""The list of changes, in the order of their commits, and the wait for the end of a job."""

import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest

from contract.key import Scope
from tests.http.harness import Service, code_of, pair


def read(service: Service, **parameters: Any) -> dict[str, Any]:
    answer = service.client.get("/v1/changes", params=parameters)
    assert answer.status_code == 200, answer.text
    document: dict[str, Any] = answer.json()
    return document


def now(service: Service) -> int:
    """Return the number of the latest change."""
    return int(read(service, since=2**53 - 1)["last"])


def test_what_happened_is_listed_once_and_in_order(service: Service, calibration: str) -> None:
    since = now(service)
    surgery = service.surgery()
    service.finished(service.submit(surgery, "PRE", pair("PRE"), calibration))
    pages, more = [], True
    position = since
    while more:
        page = read(service, since=position, limit=2, surgery_id=surgery)
        pages.append(page["changes"])
        position, more = page["last"], not page["done"]
    found = [change for page in pages for change in page]
    assert all(len(page) <= 2 for page in pages)
    assert [change["action"] for change in found] == [
        "surgery:created",
        "stage:submitted",
        "job:started",
        "stage:measured",
    ]
    assert [change["stage"] for change in found] == [None, "PRE", None, "PRE"]
    assert {change["surgery_id"] for change in found} == {surgery}
    numbers = [change["seq"] for change in found]
    assert numbers == sorted(set(numbers))
    assert read(service, since=position, surgery_id=surgery)["changes"] == []


def test_no_change_appears_before_one_that_was_read(idle: Service) -> None:
    """Many clients write while one follows: it misses nothing."""
    since = now(idle)
    with ThreadPoolExecutor(6) as pool:
        calls = [pool.submit(idle.surgery) for _ in range(30)]
        found: list[dict[str, Any]] = []
        position = since
        while not (all(call.done() for call in calls) and read(idle, since=position)["changes"] == []):
            page = read(idle, since=position, limit=3)
            found += page["changes"]
            position = page["last"]
    made = {call.result() for call in calls}
    assert {change["id"] for change in found if change["action"] == "surgery:created"} == made
    numbers = [change["seq"] for change in found]
    assert numbers == sorted(set(numbers))


def test_access_is_not_among_the_changes(idle: Service) -> None:
    since = now(idle)
    idle.make_key(Scope.STAGE_READ)
    idle.client.get("/v1/surgeries", headers={"Authorization": "Bearer sw_wrong"})
    surgery = idle.surgery()
    assert [change["id"] for change in read(idle, since=since)["changes"]] == [surgery]


def test_a_number_beyond_the_last_one_tells_so(idle: Service) -> None:
    page = read(idle, since=10**9)
    assert page["changes"] == []
    assert page["done"]
    assert page["last"] < 10**9


def test_unchanged_changes_are_not_sent_again(idle: Service) -> None:
    path = f"/v1/changes?since={now(idle)}"
    tag = idle.client.get(path).headers["etag"]
    assert idle.client.get(path, headers={"If-None-Match": tag}).status_code == 304


@pytest.mark.parametrize("query", ["since=-1", "since=x", "limit=0", "limit=1001", "since=9007199254740993"])
def test_a_query_that_is_none_is_refused(idle: Service, query: str) -> None:
    assert code_of(idle.client.get(f"/v1/changes?{query}"), 422) == "invalid-request"


def test_a_wait_ends_with_the_job(service: Service, surgery: str, calibration: str) -> None:
    job = service.submit(surgery, "PRE", pair("PRE"), calibration)
    answer = service.client.get(f"/v1/jobs/{job}", params={"wait": 60}, timeout=70)
    assert answer.json()["state"] == "succeeded"
    again = service.client.get(f"/v1/jobs/{job}", params={"wait": 60})
    assert again.json() == answer.json()


def test_a_wait_is_bounded(idle: Service) -> None:
    job = idle.submit(idle.surgery(), "PRE", pair("PRE"), idle.calibration())
    started = time.monotonic()
    answer = idle.client.get(f"/v1/jobs/{job}", params={"wait": 0.5})
    assert answer.json()["state"] == "queued"
    assert time.monotonic() - started >= 0.5
    assert code_of(idle.client.get(f"/v1/jobs/{job}", params={"wait": 61}), 422) == "invalid-request"
    assert code_of(idle.client.get("/v1/jobs/none", params={"wait": 60}), 404) == "job-not-found"


def test_many_waits_hold_no_thread(idle: Service) -> None:
    """As many wait as the server has threads for requests, and more; others are answered, and all wake together."""
    job = idle.submit(idle.surgery(), "PRE", pair("PRE"), idle.calibration())
    keys = [{"Authorization": f"Bearer {idle.make_key()}"} for _ in range(2)]  # one key has at most fifty
    with ThreadPoolExecutor(60) as pool:
        calls = [
            pool.submit(
                idle.client.get, f"/v1/jobs/{job}", params={"wait": 60}, headers=keys[k % 2], timeout=70
            )
            for k in range(60)
        ]
        for _ in range(5):
            assert idle.client.get("/v1/surgeries", params={"limit": 1}).status_code == 200
        assert idle.client.post(f"/v1/jobs/{job}/cancel").status_code == 200
        assert {call.result().json()["state"] for call in calls} == {"cancelled"}


def test_a_wait_ends_when_the_service_stops(tmp_path: Path) -> None:
    with Service(tmp_path) as service:
        job = service.submit(service.surgery(), "PRE", pair("PRE"), service.calibration())
        with ThreadPoolExecutor(1) as pool:
            call = pool.submit(service.client.get, f"/v1/jobs/{job}", params={"wait": 60}, timeout=70)
            time.sleep(0.5)
            service.server.terminate()
            assert call.result(20).json()["state"] == "queued"
        service.server.wait(20)
