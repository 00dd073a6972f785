"""A real service for black-box tests: server and workers as processes, database and queue in a folder."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any
from uuid import uuid4

import httpx

from contract.event import Actor, ActorKind
from contract.key import NewKey, Scope
from migrations.history import upgrade
from store import keys
from store.clock import utc_now
from store.database import Database
from tests.backends import new_database, new_queue, run_sql, write_lock_is_free
from tests.paths import SAMPLES
from tests.patience import PATIENCE_S

SAMPLE = SAMPLES / "D1"
BOARDS = SAMPLES / "calibration" / "C1"
RIG = json.loads((SAMPLE / "rig.json").read_text())
VERTEBRAE = ["L1", "T11", "T9", "T7"]
FINAL = {"succeeded", "failed", "cancelled"}

Pair = tuple[bytes, bytes]


def pair(stage: str) -> Pair:
    return tuple((SAMPLE / stage / f"{side}.png").read_bytes() for side in ("left", "right"))  # type: ignore[return-value]


def board(trial: str) -> Pair:
    return tuple((BOARDS / trial / f"{side}.png").read_bytes() for side in ("left", "right"))  # type: ignore[return-value]


def wait_for(condition: Callable[[], Any], what: str, every_s: float = 0.02) -> Any:
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(every_s)
    raise AssertionError(f"waited too long for {what}")


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def make_key(url: str, *scopes: Scope) -> str:
    """Make an API key in a database, one with every scope by default."""
    database = Database(url)
    try:
        with database.write() as session:
            new = NewKey(name="test", scopes=list(scopes or Scope))
            return keys.add(session, new, utc_now(), Actor(kind=ActorKind.COMMAND, name="test"))[1]
    finally:
        database.close()


class Service:
    """The server and the workers that a test starts; ``client`` is an HTTP client of the server with a ``key``."""

    def __init__(self, folder: Path, **settings: str) -> None:
        self.database = folder / "spinewatch.sqlite"
        self.queue = folder / "spinewatch-queue.sqlite"
        self._storage = ExitStack()
        self.database_url = self._storage.enter_context(new_database(folder, name="spinewatch"))
        self.queue_url = self._storage.enter_context(new_queue(folder, self.database_url))
        self.log = folder / "log.txt"
        self.port = free_port()
        self.environment = {
            "SPINEWATCH_DATABASE_URL": self.database_url,
            "SPINEWATCH_QUEUE_URL": self.queue_url,
            "SPINEWATCH_PORT": str(self.port),
            "OPENBLAS_NUM_THREADS": "1",
            **settings,
        }
        self.client = httpx.Client(
            base_url=f"http://127.0.0.1:{self.port}", timeout=PATIENCE_S, trust_env=False
        )
        self._processes: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> Service:
        upgrade(self.environment["SPINEWATCH_DATABASE_URL"])
        self.key = self.make_key()
        self.client.headers["Authorization"] = f"Bearer {self.key}"
        self.start("serve")
        wait_for(self.ready, "the service")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.client.close()
        for process in self._processes:
            if process.poll() is None:
                process.send_signal(signal.SIGCONT)
                process.terminate()
        for process in self._processes:
            try:
                process.wait(PATIENCE_S / 4)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self._storage.close()

    def make_key(self, *scopes: Scope) -> str:
        """Make an API key in the database, one with every scope by default."""
        return make_key(self.environment["SPINEWATCH_DATABASE_URL"], *scopes)

    def start(self, command: str, **settings: str) -> subprocess.Popen[bytes]:
        with self.log.open("ab") as log:
            process = subprocess.Popen(
                [sys.executable, "-m", "commands", command],
                env={**os.environ, **self.environment, **settings},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
            )
        self._processes.append(process)
        return process

    @property
    def server(self) -> subprocess.Popen[bytes]:
        """The process of the API."""
        return self._processes[0]

    def kill_workers(self) -> None:
        server, *workers = self._processes
        for process in workers:
            process.kill()
            process.wait()
        self._processes = [server]

    def logged(self, *words: str) -> bool:
        return any(all(word in line for word in words) for line in self.log.read_text().splitlines())

    def ready(self) -> bool:
        try:
            return self.client.get("/v1/health").status_code == 200
        except httpx.TransportError:
            return False

    def calibration(self, rig: dict[str, Any] = RIG) -> str:
        answer = self.client.post("/v1/calibrations", json=rig)
        assert answer.status_code == 201, answer.text
        return str(answer.json()["id"])

    def surgery(self) -> str:
        body = {
            "reference": f"case-{uuid4().int % 10**12}",
            "vertebrae": VERTEBRAE,
            "reference_vertebra": "L1",
            "spine_axis": "x",
        }
        answer = self.client.post("/v1/surgeries", json=body)
        assert answer.status_code == 201, answer.text
        return str(answer.json()["id"])

    def send(
        self, surgery: str, name: str, images: Pair, calibration: str, captured_at: str | None = None
    ) -> httpx.Response:
        fields = {"name": name, "calibration_id": calibration}
        if captured_at is not None:
            fields["captured_at"] = captured_at
        files = {"left": ("left", images[0]), "right": ("right", images[1])}
        return self.client.post(f"/v1/surgeries/{surgery}/stages", data=fields, files=files)

    def submit(self, surgery: str, name: str, images: Pair, calibration: str) -> str:
        answer = self.send(surgery, name, images, calibration)
        assert answer.status_code == 202, answer.text
        return answer.headers["Location"].removeprefix("/v1/jobs/")

    def shoot(self, *shots: Pair, field: str | bytes = "pegboard-1995", **fields: str) -> httpx.Response:
        """Submit shots of a control field: a built-in one, CSV text, or a CSV file."""
        parts: list[tuple[str, Any]] = [("left", ("left", left)) for left, _ in shots]
        parts += [("right", ("right", right)) for _, right in shots]
        data = {"name": "cart 1", **fields}
        if isinstance(field, bytes):
            parts.append(("control_field", ("board.csv", field)))
        else:
            data["control_field"] = field
        return self.client.post("/v1/calibrations/from-images", data=data, files=parts)

    def calibrated(self, *shots: Pair, **fields: Any) -> dict[str, Any]:
        """Submit shots and return their job when it has ended."""
        answer = self.shoot(*shots, **fields)
        assert answer.status_code == 202, answer.text
        return self.finished(answer.headers["Location"].removeprefix("/v1/jobs/"))

    def job(self, job_id: str) -> dict[str, Any]:
        answer = self.client.get(f"/v1/jobs/{job_id}")
        assert answer.status_code == 200, answer.text
        document: dict[str, Any] = answer.json()
        return document

    def started(self, job_id: str) -> None:
        wait_for(lambda: self.job(job_id)["state"] != "queued", "the job to start", 0.005)

    def finished(self, job_id: str) -> dict[str, Any]:
        def final() -> dict[str, Any] | None:
            job = self.job(job_id)
            return job if job["state"] in FINAL else None

        job: dict[str, Any] = wait_for(final, "the job to end")
        return job

    def events(self, *subjects: str) -> list[str]:
        """Return what happened to some subjects, as actor:subject:verb, in order."""
        places = ", ".join("?" * len(subjects))
        query = f"SELECT actor_kind || ':' || action FROM events WHERE subject_id IN ({places}) ORDER BY seq"  # noqa: S608
        return [action for (action,) in self.sql(query, *subjects)]

    def sql(self, query: str, *values: Any) -> list[tuple[Any, ...]]:
        return run_sql(self.database_url, query, *values)

    def write_locks_are_free(self) -> bool:
        """Return whether no process holds the write lock of the database or of the queue."""
        return all(write_lock_is_free(url) for url in (self.database_url, self.queue_url))


def stop(process: subprocess.Popen[bytes]) -> None:
    """Stop a process (SIGSTOP) and wait until all of its threads are stopped."""
    os.kill(process.pid, signal.SIGSTOP)
    wait_for(lambda: _thread_states(process.pid) == {"T"}, "the process to stop", 0.001)


def _thread_states(pid: int) -> set[str]:
    """Return the states (proc(5)) of a process's threads."""
    files = Path(f"/proc/{pid}/task").glob("*/stat")
    return {file.read_text().rpartition(")")[2].split()[0] for file in files}


def problem_of(answer: httpx.Response, status: int) -> dict[str, Any]:
    """Return the problem document of a response after checking its form."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    document: dict[str, Any] = answer.json()
    assert document["status"] == status
    assert document["type"].startswith("urn:spinewatch:problem:")
    assert document["title"]
    assert document["detail"]
    assert '"input"' not in answer.text
    return document


def code_of(answer: httpx.Response, status: int) -> str:
    return str(problem_of(answer, status)["type"]).removeprefix("urn:spinewatch:problem:")
