import os
import signal
import socket
import sqlite3
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from itertools import count
from pathlib import Path

import pytest

from commands.shared import local_service
from commands.shared.api_client import ApiClient, ServiceError
from commands.shared.files import OutputError
from commands.shared.local_service import LocalService, free_port
from tests.http.harness import wait_for
from tests.paths import PROJECT, SAMPLES
from tests.patience import PATIENCE_S

_STARTER = """
import sys
from pathlib import Path
from commands.shared.local_service import LocalService
sys.executable = sys.argv[2]
LocalService(Path(sys.argv[1]), 8500).__enter__()
"""


def test_a_port_in_use_is_skipped() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert free_port(port) > port


def test_no_port_is_an_error() -> None:
    with pytest.raises(ServiceError, match="are in use"):
        free_port(65536)


def test_a_folder_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.touch()
    with pytest.raises(OutputError, match=f"cannot create {file}"), LocalService(file, 8400):
        pass


def test_services_that_start_together_each_answer_for_themselves(tmp_path: Path) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    together = threading.Barrier(2, timeout=PATIENCE_S)

    def serve(name: str) -> tuple[str, str]:
        together.wait()
        with (
            LocalService(tmp_path / name, port) as service,
            ApiClient(service.url, key=service.key) as client,
        ):
            client.add_calibration((SAMPLES / "D1" / "rig.json").read_bytes())
            together.wait()
            return service.url, str(client.get("/v1/calibrations")["items"][0]["id"])

    with ThreadPoolExecutor(2) as pool:
        (first_url, first), (second_url, second) = pool.map(serve, ("a", "b"))
    assert first_url != second_url
    for name, own in (("a", first), ("b", second)):
        with closing(sqlite3.connect(tmp_path / name / "spinewatch.sqlite")) as connection:
            assert connection.execute("SELECT id FROM calibrations").fetchall() == [(own,)]


def test_modules_of_the_working_folder_are_not_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "structlog.py").write_text("raise SystemExit(1)")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(PROJECT))
    with LocalService(tmp_path / "service", 8500) as service:
        assert service.key


def program(folder: Path, lines: str) -> Path:
    """Make a program that stands for the interpreter of a service which never answers."""
    path = folder / "program"
    path.write_text(f"#!/bin/sh\n{lines}\n")
    path.chmod(0o755)
    return path


def is_there(process: int) -> bool:
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False


def test_what_does_not_get_ready_is_ended_with_all_that_it_started(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    started = tmp_path / "started"
    deaf = program(
        tmp_path, f"trap '' TERM\nsleep 600 &\necho $$ $! > {started}.new\nmv {started}.new {started}\nwait"
    )
    monkeypatch.setattr(sys, "executable", str(deaf))
    calls = count()  # the first one sets the end of the time
    monkeypatch.setattr(local_service, "monotonic", lambda: 1e9 if next(calls) and started.exists() else 0.0)
    monkeypatch.setattr(local_service, "_STOP_SECONDS", 1.0)
    with pytest.raises(ServiceError, match="not ready after 60 s and is ended"), LocalService(tmp_path, 8500):
        pass
    processes = [int(number) for number in started.read_text().split()]
    wait_for(lambda: not any(map(is_there, processes)), "the end of what was started")


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere nothing ends with its parent")
def test_the_service_ends_with_the_process_that_started_it(tmp_path: Path) -> None:
    started = tmp_path / "started"
    waiting = program(tmp_path, f"echo $$ > {started}.new\nmv {started}.new {started}\nexec sleep 600")
    starter = subprocess.Popen([sys.executable, "-c", _STARTER, tmp_path, waiting], cwd=PROJECT)
    wait_for(started.exists, "the service")
    service = int(started.read_text())
    assert is_there(service)
    os.kill(starter.pid, signal.SIGKILL)
    starter.wait()
    wait_for(lambda: not is_there(service), "the end of the service")
