"""Commands that cannot start say why and what to do, in one line."""

from __future__ import annotations

import socket
import sqlite3
import sys
from collections.abc import Iterator
from contextlib import ExitStack, closing
from pathlib import Path

import pytest

from commands import main
from migrations.history import upgrade

STARTERS = ("run", "serve", "worker", "db upgrade")
READERS = ("serve", "worker")


@pytest.fixture(autouse=True)
def short_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("store.database._BUSY_SECONDS", 0.2)


@pytest.fixture
def holding() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def refused(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], **settings: object
) -> str:
    """Return the one line that a command ends with."""
    for name, value in settings.items():
        monkeypatch.setenv(f"SPINEWATCH_{name.upper()}", str(value))
    monkeypatch.setattr(sys, "argv", ["spinewatch", *command.split()])
    with pytest.raises(SystemExit) as stopped:
        main.app()
    lines = capsys.readouterr().err.splitlines()
    assert stopped.value.code == 2
    assert len(lines) == 1, lines
    assert lines[0].startswith("spinewatch: ")
    return lines[0]


def url_of(path: Path) -> str:
    return f"sqlite:///{path}"


WAYS_OUT = {
    "corrupt": "SPINEWATCH_DATABASE_URL",
    "no database": "SPINEWATCH_DATABASE_URL",
    "folder": "SPINEWATCH_DATABASE_URL",
    "unwritable folder": "SPINEWATCH_DATABASE_URL|spinewatch db upgrade",
    "below a file": "SPINEWATCH_DATABASE_URL|spinewatch db upgrade",
    "of another program": "another program|spinewatch db upgrade",
    "newer": "9999",
    "locked": "locked",
}
"""What the line must say, one of several, for each kind of database that cannot be used."""


def made(kind: str, path: Path, holding: ExitStack) -> Path:
    """Make a database that cannot be used; return its path."""
    if kind == "corrupt":
        path.write_bytes(b"SQLite format 3\0" + b"\xff" * 20_000)
    elif kind == "no database":
        path.write_bytes(b"a letter to somebody" * 500)
    elif kind == "folder":
        path.mkdir()
    elif kind == "unwritable folder":
        path = Path("/proc/spinewatch/x.sqlite")
    elif kind == "below a file":
        path.touch()
        path = path / "y.sqlite"
    elif kind == "of another program":
        with closing(sqlite3.connect(path)) as connection:
            connection.execute("CREATE TABLE bookmarks (x)")
            connection.commit()
    elif kind == "newer":
        upgrade(url_of(path))
        with closing(sqlite3.connect(path)) as connection:
            connection.execute("UPDATE alembic_version SET version_num = '9999'")
            connection.commit()
    else:
        upgrade(url_of(path))
        other = holding.enter_context(closing(sqlite3.connect(path, isolation_level=None)))
        other.execute("BEGIN EXCLUSIVE")
    return path


@pytest.mark.parametrize("command", STARTERS)
@pytest.mark.parametrize("kind", WAYS_OUT)
def test_a_database_that_cannot_be_used(
    command: str,
    kind: str,
    tmp_path: Path,
    holding: ExitStack,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = made(kind, tmp_path / "x.sqlite", holding)
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    line = refused(command, monkeypatch, capsys, database_url=url_of(path), port=port)
    assert any(words in line for words in WAYS_OUT[kind].split("|"))


@pytest.mark.parametrize("command", READERS)
def test_a_database_that_is_missing(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    line = refused(command, monkeypatch, capsys, database_url=url_of(tmp_path / "none" / "x.sqlite"))
    assert "spinewatch db upgrade" in line
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", ["run", "serve"])
def test_a_port_in_use(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    upgrade(url_of(tmp_path / "x.sqlite"))
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        line = refused(command, monkeypatch, capsys, database_url=url_of(tmp_path / "x.sqlite"), port=port)
    assert f"port {port}" in line
    assert "--port" in line


@pytest.mark.parametrize("command", ["run", "serve", "worker"])
@pytest.mark.parametrize(
    "queue",
    [
        "sqlite:////proc/spinewatch/q.sqlite",
        "sqlite:///{folder}",
        "sqlite:///{folder}/x.sqlite",
        "sqlite:///{folder}/notes.txt",
        "amqp://host",
    ],
)
def test_a_queue_that_cannot_be_used(
    command: str,
    queue: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    database = tmp_path / "x.sqlite"
    upgrade(url_of(database))
    (tmp_path / "notes.txt").write_text("my notes")
    url = queue.format(folder=tmp_path)
    line = refused(command, monkeypatch, capsys, database_url=url_of(database), queue_url=url, port=1)
    assert "SPINEWATCH_QUEUE_URL" in line
    assert (tmp_path / "notes.txt").read_text() == "my notes"
    assert not list(tmp_path.glob("*.broken"))


@pytest.mark.parametrize("command", [*STARTERS, "backup copy.sqlite", "restore copy.sqlite"])
def test_a_setting_that_does_not_exist(
    command: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    line = refused(command, monkeypatch, capsys, prot=9000)
    assert "did you mean SPINEWATCH_PORT?" in line


@pytest.mark.parametrize(
    ("command", "words"),
    [
        ("backup {folder}/copy.sqlite", "there is no database"),
        ("backup {folder}/none/copy.sqlite", "there is no"),
        ("verify {folder}/none.sqlite", "name a backup"),
        ("verify {folder}", "name a backup"),
        ("restore {folder}/none.sqlite", "name a backup"),
        ("restore {folder}/letter", "choose another backup"),
    ],
)
def test_a_backup_that_cannot_be_made_or_used(
    command: str,
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "letter").write_bytes(b"a letter to somebody" * 500)
    url = url_of(tmp_path / "x.sqlite")
    assert words in refused(command.format(folder=tmp_path), monkeypatch, capsys, database_url=url)


@pytest.mark.parametrize("command", [*STARTERS, "key list", "backup copy.sqlite"])
@pytest.mark.parametrize("url", ["sqlite://", "sqlite:///:memory:"])
def test_a_record_in_memory(
    command: str, url: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    line = refused(command, monkeypatch, capsys, database_url=url)
    assert "SPINEWATCH_DATABASE_URL" in line
    assert "name a file" in line


@pytest.mark.parametrize("command", ["run", "serve", "worker"])
def test_a_queue_that_does_not_answer(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    upgrade(url_of(tmp_path / "x.sqlite"))
    with socket.socket() as bound:  # nothing listens there, and nothing else can
        bound.bind(("127.0.0.1", 0))
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        url = f"redis://127.0.0.1:{bound.getsockname()[1]}/0"
        line = refused(
            command,
            monkeypatch,
            capsys,
            database_url=url_of(tmp_path / "x.sqlite"),
            queue_url=url,
            port=port,
        )
    assert "the queue does not answer" in line
    assert "SPINEWATCH_QUEUE_URL" in line


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("max_cpu_seconds", "1e30"),
        ("worker_memory_bytes", "1" + "0" * 20),
        ("allowed_origins", "*"),
        ("reference_pattern", "(?=K)K[0-9]+"),
    ],
)
@pytest.mark.parametrize("command", STARTERS)
def test_a_setting_that_can_never_work(
    command: str, name: str, value: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert f"SPINEWATCH_{name.upper()}: " in refused(command, monkeypatch, capsys, **{name: value})
