"""Many clients write at once while the database is held: others read as usual, and each writer is told in time."""

import json
import select
import socket
from contextlib import ExitStack
from uuid import uuid4

import pytest

from tests.backends import held_write_lock
from tests.hostile.attack import connect, head, received, status
from tests.http.harness import RIG, VERTEBRAE, Service, wait_for

WRITERS = 80
THREADS = 40
"""Threads in which the service answers requests."""


@pytest.fixture
def service(idle: Service) -> Service:
    return idle


def surgery_document() -> dict[str, object]:
    return {
        "reference": f"case-{uuid4().int % 10**12}",
        "vertebrae": VERTEBRAE,
        "reference_vertebra": "L1",
        "spine_axis": "x",
    }


def change(service: Service, number: int) -> bytes:
    """Return a request that changes something, of one kind after the other."""
    body = json.dumps((surgery_document(), RIG)[number % 2]).encode()
    sent = ("Content-Type: application/json", f"Content-Length: {len(body)}")
    match number % 4:
        case 0:
            return head(service, "POST /v1/surgeries HTTP/1.1", *sent) + body
        case 1:
            return (
                head(service, "POST /v1/calibrations HTTP/1.1", f"Idempotency-Key: {uuid4()}", *sent) + body
            )
        case 2:
            return head(service, f"DELETE /v1/surgeries/{uuid4()} HTTP/1.1")
        case _:
            return head(service, f"POST /v1/jobs/{uuid4()}/cancel HTTP/1.1", "Content-Length: 0")


def test_reads_do_not_wait_behind_writers_and_no_writer_waits_without_end(service: Service) -> None:
    surgery, job_of_nobody = service.surgery(), uuid4()
    (before,) = service.sql("SELECT count(*) FROM surgeries")
    reads = {
        "/health/live": 200,
        "/v1/health": 200,
        "/health/ready": 503,
        "/": 200,
        "/v1/surgeries": 200,
        f"/v1/surgeries/{surgery}": 200,
        f"/v1/jobs/{job_of_nobody}": 404,
        "/v1/changes": 200,
        "/metrics": 200,
    }
    with ExitStack() as opened, held_write_lock(service.database_url):
        writers = [opened.enter_context(connect(service)) for _ in range(WRITERS)]
        for number, writer in enumerate(writers):
            writer.sendall(change(service, number))
        for path, expected in reads.items():
            assert service.client.get(path).status_code == expected, path
            # if writers had all threads, the first read would be answered after the fortieth writer from the end
            assert len(answered(writers)) < WRITERS - THREADS, path
        wait_for(lambda: len(answered(writers)) == WRITERS, "every writer to be answered")
        answers = [received(writer) for writer in writers]
    assert {status(answer) for answer in answers} == {503}
    assert all(b"retry-after: " in answer.lower() for answer in answers)
    codes = {json.loads(answer.partition(b"\r\n\r\n")[2])["type"].rpartition(":")[2] for answer in answers}
    assert codes == {"too-busy", "database-unavailable"}
    assert service.sql("SELECT count(*) FROM surgeries") == [before]
    assert service.client.post("/v1/surgeries", json=surgery_document()).status_code == 201


def answered(connections: list[socket.socket]) -> list[socket.socket]:
    return select.select(connections, [], [], 0)[0]
