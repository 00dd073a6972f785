import json
import socket
from pathlib import Path

import pytest
from typer.testing import CliRunner

from commands.main import cli


def run(*options: str) -> str:
    result = CliRunner().invoke(cli, ["sbom", *options])
    assert result.exit_code == 0, result.output
    return result.stdout


@pytest.fixture(autouse=True)
def no_network(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise AssertionError("the command used the network")

    monkeypatch.setattr(socket.socket, "connect", refuse)


def test_it_is_cyclonedx_json_with_the_hashes_of_the_lock(tmp_path: Path) -> None:
    file = tmp_path / "bom.json"
    assert run("--output", str(file)) == ""
    bill = json.loads(file.read_text(encoding="utf-8"))
    assert (bill["bomFormat"], bill["specVersion"]) == ("CycloneDX", "1.6")
    assert bill["metadata"]["component"]["name"] == "spinewatch"
    assert "sha" in json.dumps(bill).lower()


def test_another_lock_may_be_named(tmp_path: Path) -> None:
    lock = tmp_path / "empty.lock"
    lock.write_text("", encoding="utf-8")
    assert "SHA-256" not in run("--lock", str(lock))
    assert "SHA-256" in run()


def test_the_list_to_read_has_version_licence_maker_and_anomalies() -> None:
    lines = run("--known-anomalies").splitlines()
    (huey,) = [number for number, line in enumerate(lines) if line.startswith("huey ")]
    assert "Charles Leifer" in lines[huey]
    assert "SPINEWATCH-HUEY-1: A message is deleted" in lines[huey + 1]
    assert any(line.startswith("sqlite 3.") for line in lines)


def test_a_lock_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    result = CliRunner().invoke(cli, ["sbom", "--lock", str(tmp_path / "none")])
    assert "cannot read" in str(result.exception)
