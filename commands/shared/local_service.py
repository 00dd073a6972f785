"""A private service: ``spinewatch run`` as a child process that ends with this one."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path
from time import monotonic, sleep
from types import TracebackType
from typing import BinaryIO

from commands.shared.api_client import ApiClient, ServiceError
from commands.shared.files import OutputError, make_folder

_HOST = "127.0.0.1"
_MAX_PORTS = 50
_START_SECONDS = 60.0
_STOP_SECONDS = 10.0
_LOG_TAIL_LINES = 5


class LocalService:
    """A context manager: starts a service with its database in ``folder``, and stops it on exit."""

    def __init__(self, folder: Path, port: int) -> None:
        self._folder = folder.resolve()
        self._log = self._folder / "service.log"
        self.port = free_port(port)
        self.url = f"http://{_HOST}:{self.port}"

    def __enter__(self) -> LocalService:
        log = self._open_log()
        print(f"Starting the service at {self.url}, database in {self._folder} ...", flush=True)  # noqa: T201
        settings = {
            "SPINEWATCH_DATABASE_URL": f"sqlite:///{self._folder / 'spinewatch.sqlite'}",
            "SPINEWATCH_HOST": _HOST,
            "SPINEWATCH_PORT": str(self.port),
        }
        with log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "commands", "run"],
                env={**os.environ, **settings},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # Ctrl-C reaches only this process, which then stops the service
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
        """Wait for Ctrl-C; raises ``ServiceError`` if the service ends first."""
        print(f"Serving at {self.url} until Ctrl-C; log in {self._log}", flush=True)  # noqa: T201
        try:
            self._process.wait()
        except KeyboardInterrupt:
            return
        raise ServiceError(f"the service ended: {self._log_tail()}")

    def _open_log(self) -> BinaryIO:
        make_folder(self._folder)
        try:
            return self._log.open("wb")
        except OSError as error:
            raise OutputError(f"cannot write {self._log}: {error.strerror}") from error

    def _wait_until_ready(self) -> None:
        deadline = monotonic() + _START_SECONDS
        with ApiClient(self.url) as client:
            while not client.ready():
                if self._process.poll() is not None:
                    raise ServiceError(f"the service did not start: {self._log_tail()}")
                if monotonic() > deadline:
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

    def _log_tail(self) -> str:
        lines = self._log.read_text(errors="replace").strip().splitlines()
        return " | ".join(lines[-_LOG_TAIL_LINES:]) or f"see {self._log}"


def free_port(first: int) -> int:
    """Return the first free port from ``first`` on; raises ``ServiceError`` if none is free."""
    for port in range(first, min(first + _MAX_PORTS, 65536)):
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((_HOST, port))
            except OSError:
                continue
            return port
    raise ServiceError(f"ports {first} to {first + _MAX_PORTS - 1} are in use; choose another with --port")
