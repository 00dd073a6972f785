"""A private service: ``spinewatch run`` as a child process that ends with this one."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import ExitStack, suppress
from pathlib import Path
from time import monotonic, sleep
from types import TracebackType
from typing import BinaryIO
from uuid import uuid4

from commands.shared.address import PortTakenError, require_free_port
from commands.shared.api_client import ApiClient, ServiceError
from commands.shared.files import OutputError, make_folder
from commands.shared.key_making import temporary_key
from commands.shared.supervisor import die_with_parent

_HOST = "127.0.0.1"
_TLS = frozenset({"SPINEWATCH_TLS_CERT", "SPINEWATCH_TLS_KEY"})
"""Settings of a service that others reach, which this one is not."""

_MAX_PORTS = 50
_MAX_STARTS = 10
_START_SECONDS = 60.0
_STOP_SECONDS = 10.0
_LOG_TAIL_LINES = 5


class LocalService:
    """A context manager: starts a service with its database in ``folder``, and stops it on exit.

    ``key`` is an API key with every scope, which is valid until then.
    """

    def __init__(self, folder: Path, port: int) -> None:
        self._folder = folder.resolve()
        self._log = self._folder / "service.log"
        self._first_port = port
        self._instance = uuid4().hex
        self._database_url = f"sqlite:///{self._folder / 'spinewatch.sqlite'}"
        self._key = ExitStack()
        self.url = ""

    def __enter__(self) -> LocalService:
        for _ in range(_MAX_STARTS):
            if self._starts(free_port(self._first_port)):
                return self
        raise ServiceError("other programs take each port that is free; choose another with --port")

    def _starts(self, port: int) -> bool:
        """Start the service; return whether it serves, False when another program took the port meanwhile."""
        log = self._open_log()
        self.url = f"http://{_HOST}:{port}"
        print(f"Starting the service at {self.url}, database in {self._folder} ...", flush=True)  # noqa: T201
        settings = {
            "SPINEWATCH_DATABASE_URL": self._database_url,
            "SPINEWATCH_HOST": _HOST,
            "SPINEWATCH_PORT": str(port),
            "SPINEWATCH_INSTANCE_ID": self._instance,
        }
        with log:
            self._process = subprocess.Popen(
                [sys.executable, "-P", "-m", "commands", "run", "--no-first-key"],
                env={**{key: value for key, value in os.environ.items() if key not in _TLS}, **settings},
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # Ctrl-C reaches only this process, which then stops the service
                preexec_fn=die_with_parent,  # noqa: PLW1509 - the commands have one thread here
            )
        try:
            if not self._serves(port):
                self._stop()
                return False
            self.key = self._key.enter_context(temporary_key(self._database_url, "sample"))
        except BaseException:
            self._stop()
            raise
        return True

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop()

    def serve_until_interrupted(self) -> None:
        """Wait for Ctrl-C; raises ``ServiceError`` if the service ends first."""
        print(f"Serving at {self.url} until Ctrl-C; log in {self._log}", flush=True)  # noqa: T201
        print(f"API key until then: {self.key}\nOpen {self.url}/#key={self.key}", flush=True)  # noqa: T201
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

    def _serves(self, port: int) -> bool:
        """Wait for an answer on the port; return whether it is that of the service started here."""
        deadline = monotonic() + _START_SECONDS
        with ApiClient(self.url) as client:
            while (answered := client.instance()) is None:
                if self._process.poll() is not None:
                    if not _is_free(port):
                        return False
                    raise ServiceError(f"the service did not start: {self._log_tail()}")
                if monotonic() > deadline:
                    raise ServiceError(
                        f"the service is not ready after {_START_SECONDS:.0f} s and is ended; see {self._log}"
                    )
                sleep(0.05)
        return answered == self._instance

    def _stop(self) -> None:
        """Revoke the key and end the service, whatever fails or interrupts this."""
        try:
            self._key.close()
        finally:
            self._process.terminate()
            try:
                with suppress(subprocess.TimeoutExpired):
                    self._process.wait(_STOP_SECONDS)
            finally:
                if self._process.poll() is None:
                    os.killpg(self._process.pid, signal.SIGKILL)  # its session: what it started ends too
                    self._process.wait()

    def _log_tail(self) -> str:
        lines = self._log.read_text(errors="replace").strip().splitlines()
        return " | ".join(lines[-_LOG_TAIL_LINES:]) or f"see {self._log}"


def free_port(first: int) -> int:
    """Return the first free port from ``first`` on; raises ``ServiceError`` if none is free."""
    for port in range(first, min(first + _MAX_PORTS, 65536)):
        if _is_free(port):
            return port
    raise ServiceError(f"ports {first} to {first + _MAX_PORTS - 1} are in use; choose another with --port")


def _is_free(port: int) -> bool:
    try:
        require_free_port(_HOST, port)
    except PortTakenError:
        return False
    return True
