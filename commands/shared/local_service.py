"""A service of one's own: ``spinewatch run`` as a child process that ends with this one."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path
from time import monotonic, sleep
from types import TracebackType

from commands.shared.api_client import ApiClient, ServiceError

_HOST = "127.0.0.1"
_PORTS_TRIED = 50
_START_SECONDS = 60.0
_STOP_SECONDS = 10.0
_LOG_TAIL = 5


class LocalService:
    """Starts the service with its record in ``folder``; a context manager that is left when it is stopped."""

    def __init__(self, folder: Path, port: int) -> None:
        self._folder = folder.resolve()
        self._log = self._folder / "service.log"
        self.port = free_port(port)
        self.url = f"http://{_HOST}:{self.port}"

    def __enter__(self) -> LocalService:
        self._folder.mkdir(parents=True, exist_ok=True)
        print(f"Starting the service at {self.url}, record in {self._folder} ...", flush=True)  # noqa: T201
        settings = {
            "SPINEWATCH_DATABASE_URL": f"sqlite:///{self._folder / 'spinewatch.sqlite'}",
            "SPINEWATCH_HOST": _HOST,
            "SPINEWATCH_PORT": str(self.port),
        }
        with self._log.open("wb") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "commands", "run"],
                env={**os.environ, **settings},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # Ctrl-C is ours: the service is then asked to stop
            )
        try:
            self._wait_until_ready()
        except BaseException:
            self._stop()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop()

    def serve_until_interrupted(self) -> None:
        """Wait for Ctrl-C; raises ``ServiceError`` when the service ends by itself."""
        print(f"Serving at {self.url} until Ctrl-C; log in {self._log}", flush=True)  # noqa: T201
        try:
            self._process.wait()
        except KeyboardInterrupt:
            return
        raise ServiceError(f"the service ended: {self._last_words()}")

    def _wait_until_ready(self) -> None:
        end = monotonic() + _START_SECONDS
        with ApiClient(self.url) as cart:
            while not cart.ready():
                if self._process.poll() is not None:
                    raise ServiceError(f"the service did not start: {self._last_words()}")
                if monotonic() > end:
                    raise ServiceError(
                        f"the service is not ready after {_START_SECONDS:.0f} s; see {self._log}"
                    )
                sleep(0.05)

    def _stop(self) -> None:
        self._process.terminate()
        try:
            self._process.wait(_STOP_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _last_words(self) -> str:
        lines = self._log.read_text(errors="replace").strip().splitlines()
        return " | ".join(lines[-_LOG_TAIL:]) or f"see {self._log}"


def free_port(first: int) -> int:
    """Return the first free port from ``first`` on; raises ``ServiceError`` when all are taken."""
    for port in range(first, min(first + _PORTS_TRIED, 65536)):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((_HOST, port))
            except OSError:
                continue
            return port
    raise ServiceError(f"ports {first} to {first + _PORTS_TRIED - 1} are taken; choose another with --port")
