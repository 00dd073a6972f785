"""``spinewatch run``, and commands that cannot start."""

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import urllib.request
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import pytest

from store.revision import REVISION
from store.verification import verify
from tests.http.harness import free_port, wait_for
from tests.paths import PROJECT
from tests.patience import PATIENCE_S

COMMAND = [sys.executable, "-m", "commands"]


def environment(folder: Path, **settings: str) -> dict[str, str]:
    return {
        **os.environ,
        "SPINEWATCH_DATABASE_URL": f"sqlite:///{folder / 'new' / 'spinewatch.sqlite'}",
        **settings,
    }


def children_of(process: subprocess.Popen[bytes]) -> dict[int, str]:
    pids = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
    commands = {int(pid): Path(f"/proc/{pid}/cmdline").read_text().split("\0") for pid in pids}
    return {pid: words[-2] for pid, words in commands.items() if len(words) > 1}  # the dead have no command


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


class Running:
    """A supervised service and where it serves."""

    def __init__(
        self,
        folder: Path,
        command: Sequence[str] = COMMAND,
        cwd: Path | None = None,
        env: Mapping[str, str] | None = None,
    ) -> None:
        self.port = free_port()
        self.output = folder / "out.txt"
        with self.output.open("wb") as out:
            self.process = subprocess.Popen(
                [*command, "run", "--port", str(self.port), "--workers", "1"],
                cwd=cwd,
                env=environment(folder, **(env or {})),
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=out,
            )

    def ready(self) -> bool:
        return f"Spinewatch serves at http://127.0.0.1:{self.port} " in self.output.read_text()

    def healthy(self) -> bool:
        try:
            with urllib.request.urlopen(
                f"http://127.0.0.1:{self.port}/v1/health", timeout=PATIENCE_S
            ) as answer:
                return bool(json.load(answer)["status"] == "live")
        except OSError:
            return False


@pytest.fixture
def running(tmp_path: Path) -> Iterator[Running]:
    running = Running(tmp_path)
    try:
        wait_for(running.ready, "the service to be announced")
        yield running
    finally:
        running.process.kill()
        running.process.wait()


def test_what_dies_is_started_again_and_all_stop_together(running: Running) -> None:
    first = children_of(running.process)
    assert sorted(first.values()) == ["serve", "worker"]
    for pid in first:
        os.kill(pid, signal.SIGKILL)

    def all_new() -> bool:
        now = children_of(running.process)
        return sorted(now.values()) == ["serve", "worker"] and not set(now) & set(first)

    wait_for(all_new, "both to be started again")
    wait_for(running.healthy, "the new server")
    last = children_of(running.process)
    running.process.terminate()
    assert running.process.wait(PATIENCE_S) == 0
    assert not any(alive(pid) for pid in last)
    copy = shutil.copyfile(
        running.output.parent / "new" / "spinewatch.sqlite", running.output.with_name("copy")
    )
    assert verify(copy).problems == ()


def test_nothing_is_run_from_the_folder_that_it_is_started_in(tmp_path: Path) -> None:
    folder = tmp_path / "shared"
    folder.mkdir()
    for name in ("structlog", "commands", "secrets"):
        (folder / f"{name}.py").write_text("raise SystemExit('a module of the working folder')")
    running = Running(
        tmp_path,
        command=[sys.executable, "-P", "-m", "commands"],  # as its script starts it
        cwd=folder,
        env={"PYTHONPATH": str(PROJECT)},
    )
    try:
        wait_for(lambda: running.ready() or running.process.poll() is not None, "the service or its end")
        assert "a module of the working folder" not in running.output.read_text()
        assert running.ready()
    finally:
        running.process.terminate()
        running.process.wait(PATIENCE_S)


def test_a_first_key_is_printed_once_with_the_address_of_the_page(running: Running) -> None:
    wait_for(lambda: "Open http" in running.output.read_text(), "the address of the page")
    output = running.output.read_text()
    (key,) = set(re.findall(r"sw_[a-z2-7]{8}_[a-z2-7]{52}", output))
    assert f"Open http://127.0.0.1:{running.port}/#key={key}\n" in output
    assert f"shown only here: {key}\n" in output
    request = urllib.request.Request(
        f"http://127.0.0.1:{running.port}/v1/session", headers={"Authorization": f"Bearer {key}"}
    )
    with urllib.request.urlopen(request, timeout=PATIENCE_S) as answer:  # noqa: S310
        assert json.load(answer)["scopes"] == ["admin"]
    running.process.terminate()
    running.process.wait(PATIENCE_S)
    again = Running(running.output.parent)
    try:
        wait_for(again.ready, "the service to be announced again")
    finally:
        again.process.terminate()
        again.process.wait(PATIENCE_S)
    assert "sw_" not in again.output.read_text()


def test_nothing_outlives_a_killed_supervisor(running: Running) -> None:
    children = children_of(running.process)
    running.process.kill()
    running.process.wait()
    wait_for(lambda: not any(alive(pid) for pid in children), "the children to end")


def refusal(*arguments: str, folder: Path, **settings: str) -> str:
    ended = subprocess.run(
        [*COMMAND, *arguments],
        env=environment(folder, **settings),
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert ended.returncode == 2, ended.stderr
    assert len(ended.stderr.strip().splitlines()) == 1, ended.stderr
    return ended.stderr


@pytest.mark.parametrize("command", ["serve", "worker"])
def test_without_tables_nothing_starts(tmp_path: Path, command: str) -> None:
    assert "spinewatch db upgrade" in refusal(command, folder=tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_db_upgrade_makes_the_database_and_may_be_repeated(tmp_path: Path) -> None:
    for _ in range(2):
        done = subprocess.run(
            [*COMMAND, "db", "upgrade"], env=environment(tmp_path), capture_output=True, text=True, check=True
        )
        assert f"revision {REVISION}" in done.stdout
    assert (tmp_path / "new" / "spinewatch.sqlite").exists()


def test_a_setting_that_makes_no_sense_is_named(tmp_path: Path) -> None:
    said = refusal("serve", folder=tmp_path, SPINEWATCH_PORT="many")
    assert "SPINEWATCH_PORT" in said
    assert "many" not in said
    assert "SPINEWATCH_DATABASE_URL" in refusal("serve", folder=tmp_path, SPINEWATCH_DATABASE_URL="nonsense")


def test_a_queue_that_cannot_be_used_is_named(tmp_path: Path) -> None:
    subprocess.run([*COMMAND, "db", "upgrade"], env=environment(tmp_path), capture_output=True, check=True)
    for command in ("serve", "worker"):
        assert "SPINEWATCH_QUEUE_URL" in refusal(command, folder=tmp_path, SPINEWATCH_QUEUE_URL="amqp://host")


def test_a_port_in_use_is_named(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        assert port in refusal("run", "--port", port, folder=tmp_path)
