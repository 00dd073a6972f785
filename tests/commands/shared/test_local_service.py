import socket
import sqlite3
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import pytest

from commands.shared.api_client import ApiClient, ServiceError
from commands.shared.files import OutputError
from commands.shared.local_service import LocalService, free_port
from tests.paths import SAMPLES
from tests.patience import PATIENCE_S


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
