"""What attacks on a real service share: raw connections, and the cost to the process of the API."""

from __future__ import annotations

import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx

from tests.hostile.liveness import Liveness, cpu_clock_s
from tests.http.harness import Service, problem_of

MAX_DELAY_S = 0.1
"""CPU time of the API for which no single request may keep another client waiting."""
MAX_CPU_S = 0.1
"""CPU time of the API for a request."""
MAX_MEMORY_BYTES = 300_000_000
PATIENCE_S = 30.0
JSON = {"Content-Type": "application/json"}


def peak_memory(pid: int) -> int:
    """Return the largest resident memory of a process since ``forget_peak``, bytes."""
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmHWM"))


def forget_peak(pid: int) -> None:
    Path(f"/proc/{pid}/clear_refs").write_text("5")


@contextmanager
def harmless(service: Service, requests: int = 1) -> Iterator[None]:
    """Check the cost of what is done inside to the API, and that other clients are answered meanwhile."""
    pid = service.server.pid
    forget_peak(pid)
    with Liveness(service) as another_client:
        before = cpu_clock_s(pid)
        yield
        used = cpu_clock_s(pid) - before - another_client.cost_s
    assert another_client.delay_s <= MAX_DELAY_S, f"others waited for {another_client.delay_s:.3f} s of CPU"
    assert peak_memory(pid) < MAX_MEMORY_BYTES, f"{peak_memory(pid) / 1e6:.0f} MB"
    assert used <= MAX_CPU_S * requests, f"{used:.3f} s of CPU for {requests} requests"
    with httpx.Client(base_url=service.client.base_url, timeout=PATIENCE_S, trust_env=False) as another:
        assert another.get("/health/live").status_code == 200


def refused(service: Service, answer: httpx.Response) -> dict[str, Any]:
    """Return the problem of an answer, which is the client's fault."""
    assert 400 <= answer.status_code < 500, answer.text
    return problem_of(answer, answer.status_code)


def credentials(service: Service) -> dict[str, str]:
    """Return the header with the key of the harness's client."""
    return {name: value for name, value in service.client.headers.items() if name == "authorization"}


def head(service: Service, line: str, *headers: str) -> bytes:
    """Return the head of a request with a right Host and key."""
    key = [f"{name}: {value}" for name, value in credentials(service).items()]
    return "\r\n".join([line, f"Host: 127.0.0.1:{service.port}", *key, *headers, "", ""]).encode("latin-1")


def connect(service: Service) -> socket.socket:
    return socket.create_connection(("127.0.0.1", service.port), timeout=PATIENCE_S)


def exchange(service: Service, *sent: bytes, pause_s: float = 0.0) -> bytes:
    """Return everything that the server answers until it closes the connection or nothing more arrives."""
    with connect(service) as connection:
        try:
            for data in sent:
                connection.sendall(data)
                time.sleep(pause_s)
        except OSError:
            pass  # the server has closed the connection; its answer may still be read
        return received(connection)


def received(connection: socket.socket) -> bytes:
    """Return one answer, or all of them when the server closes the connection."""
    answer = b""
    try:
        while not _complete(answer):
            data = connection.recv(65536)
            if not data:
                break
            answer += data
    except ConnectionResetError:
        pass
    return answer


def status(answer: bytes) -> int:
    """Return the status of the first answer."""
    assert answer.startswith(b"HTTP/1.1 "), answer[:200]
    return int(answer[9:12])


def _complete(answer: bytes) -> bool:
    lines, end, body = answer.partition(b"\r\n\r\n")
    lengths = [line[15:] for line in lines.lower().split(b"\r\n") if line.startswith(b"content-length:")]
    return bool(end and lengths) and len(body) >= int(lengths[0])
