import socket
from pathlib import Path

import pytest

from commands.shared.api_client import ServiceError
from commands.shared.files import OutputError
from commands.shared.local_service import LocalService, free_port


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
