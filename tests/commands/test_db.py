import sys
from pathlib import Path

import pytest
from alembic import command

from commands import main
from migrations.history import config, head, upgrade
from store.database import Database


@pytest.fixture
def old(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A database of an earlier version."""
    path = tmp_path / "x.sqlite"
    url = f"sqlite:///{path}"
    upgrade(url)
    database = Database(url)
    with database.write() as session:
        command.downgrade(config(session.connection()), "0011")
    database.close()
    monkeypatch.setenv("SPINEWATCH_DATABASE_URL", url)
    return path


def upgraded(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *options: str) -> str:
    monkeypatch.setattr(sys, "argv", ["spinewatch", "db", "upgrade", *options])
    with pytest.raises(SystemExit) as ended:
        main.app()
    assert not ended.value.code
    return capsys.readouterr().out


def test_the_copy_made_before_a_migration_is_named(
    old: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    copy = old.with_name("x-revision-0011.sqlite")
    out = upgraded(monkeypatch, capsys)
    assert f"is kept as {copy}" in out
    assert f"at revision {head()}" in out
    assert copy.exists()
    assert upgraded(monkeypatch, capsys) == f"the database is at revision {head()}\n"


def test_no_copy_is_made_when_none_is_wanted(
    old: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "kept" not in upgraded(monkeypatch, capsys, "--no-copy")
    assert len(list(old.parent.glob("*.sqlite"))) == 1
