"""A service to load: ``spinewatch run`` with a database of its own, and an API key."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from uuid import uuid4

import httpx

from bench import load_processes
from bench.load_processes import Process, Role
from contract.event import Actor, ActorKind
from contract.key import NewKey, Scope
from migrations.history import upgrade
from settings import Settings
from store import keys
from store.clock import utc_now
from store.database import Database
from store.queue import JobQueue

_PATIENCE_S = 120.0
_STOP_S = 15.0
_POLL_S = 0.05
_RESTART_S = 0.2


class ServiceStuckError(Exception):
    """The service did not start, or a job did not end, in far more time than it needs."""


class LoadService:
    """A context manager: the service of a folder; it is started again whenever its supervisor has ended.

    Parameters
    ----------
    folder
        Where database, queue and log are.
    workers
        Number of worker processes.
    database_url, queue_url
        Database and queue; by default files in the folder.

    Attributes
    ----------
    key
        API key with every scope.
    long_poll
        Whether a job can be waited for in the request.
    """

    def __init__(
        self, folder: Path, workers: int = 2, database_url: str | None = None, queue_url: str | None = None
    ) -> None:
        self.folder = folder
        self.database_url = database_url or f"sqlite:///{folder / 'spinewatch.sqlite'}"
        self.log = folder / "log.txt"
        self._mark = f"SERVICE_UNDER_LOAD={uuid4()}"
        name, _, value = self._mark.partition("=")
        self._environment = {
            name: value,
            "SPINEWATCH_DATABASE_URL": self.database_url,
            "SPINEWATCH_PORT": str(_free_port()),
            "SPINEWATCH_WORKERS": str(workers),
        }
        if queue_url is not None:
            self._environment["SPINEWATCH_QUEUE_URL"] = queue_url
        self.url = f"http://127.0.0.1:{self._environment['SPINEWATCH_PORT']}"
        self._workers = workers
        self._queue_url = queue_url
        self._supervisor: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> LoadService:
        upgrade(self.database_url)
        self.key = self._make_key()
        try:
            self.keep_running()
            self.wait_until_ready()
            self.long_poll = self._supports_long_poll()
        except BaseException:
            self.stop()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.stop()

    def another(self) -> LoadService:
        """Return a service like this one, with a new database and queue in files of a folder of its own."""
        folder = self.folder / f"service-{uuid4()}"
        folder.mkdir()
        return LoadService(folder, self._workers)

    def client(self, timeout_s: float = 60.0) -> httpx.Client:
        """Return a client with the key; the caller closes it."""
        headers = {"Authorization": f"Bearer {self.key}"}
        return httpx.Client(base_url=self.url, headers=headers, timeout=timeout_s, trust_env=False)

    def keep_running(self) -> None:
        """Start the supervisor unless it runs, as a service manager does."""
        if self._supervisor is not None and self._supervisor.poll() is None:
            return
        with self.log.open("ab") as log:
            self._supervisor = subprocess.Popen(
                [sys.executable, "-m", "commands", "run"],
                env={**os.environ, **self._environment},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )

    def processes(self) -> list[Process]:
        """Return the living processes of the service."""
        return load_processes.find(self._mark)

    def wait_until_ready(self) -> None:
        """Wait until the API answers and every worker is there; start the supervisor again where it has ended."""
        end = time.monotonic() + _PATIENCE_S
        with self.client(5.0) as client:
            while time.monotonic() < end:
                self.keep_running()
                if _answers(client) and self._ready_workers() >= self._workers:
                    return
                time.sleep(_RESTART_S)
        raise ServiceStuckError(f"the service is not ready after {_PATIENCE_S:.0f} s; see {self.log}")

    def stop(self) -> None:
        """End every process of the service."""
        if self._supervisor is not None:
            self._supervisor.terminate()
            with suppress(subprocess.TimeoutExpired):
                self._supervisor.wait(_STOP_S)
        end = time.monotonic() + _STOP_S
        while (left := self.processes()) and time.monotonic() < end:
            time.sleep(_POLL_S)
        load_processes.kill(process.pid for process in left)
        if self._supervisor is not None:
            self._supervisor.wait()

    def database(self) -> Database:
        """Return the database; the caller closes it."""
        return Database(self.database_url)

    def queue(self) -> JobQueue:
        """Return the queue; the caller closes it."""
        return JobQueue(Settings(database_url=self.database_url, queue_url=self._queue_url).queue)

    def _make_key(self) -> str:
        database = self.database()
        try:
            with database.write() as session:
                new = NewKey(name="load", scopes=list(Scope))
                actor = Actor(kind=ActorKind.COMMAND, name="bench.load")
                return keys.add(session, new, utc_now(), actor)[1]
        finally:
            database.close()

    def _supports_long_poll(self) -> bool:
        """Return whether a job can be waited for in the request."""
        with self.client() as client:
            paths = client.get("/openapi.json").raise_for_status().json()["paths"]
        parameters = paths["/v1/jobs/{job_id}"]["get"]["parameters"]
        return any(parameter["name"] == "wait" for parameter in parameters)

    def _ready_workers(self) -> int:
        """Return the number of living workers that have logged that they are ready."""
        text = self.log.read_text(errors="replace")
        alive = [p.pid for p in self.processes() if p.role is Role.WORKER]
        return sum(f"pid={pid}" in text for pid in alive)


def _answers(client: httpx.Client) -> bool:
    try:
        return client.get("/v1/calibrations?limit=1").status_code == httpx.codes.OK
    except httpx.TransportError:
        return False


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
