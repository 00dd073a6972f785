from pathlib import Path

import pytest
from sqlalchemy.exc import OperationalError

from commands.shared.configuration import (
    SettingsError,
    load_settings,
    migrate_database,
    require_database,
    require_queue,
)
from store.errors import DatabaseNotReadyError, QueueURLError


def test_an_option_overrides_its_environment_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SPINEWATCH_PORT", "9000")
    assert load_settings(port=None).port == 9000
    assert load_settings(port=9001).port == 9001


def test_an_invalid_setting_is_named_without_its_value(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SPINEWATCH_PORT", "many")
    with pytest.raises(SettingsError, match=r"SPINEWATCH_PORT: .*; see docs/operations.md") as raised:
        load_settings()
    assert "many" not in str(raised.value)


def test_an_unknown_setting_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SPINEWATCH_PROT", "9000")
    with pytest.raises(SettingsError, match="no setting SPINEWATCH_PROT, did you mean SPINEWATCH_PORT"):
        load_settings()


def test_a_queue_must_have_a_url_of_a_known_kind(tmp_path: Path) -> None:
    require_queue(load_settings(queue_url=f"sqlite:///{tmp_path / 'queue.sqlite'}"))
    with pytest.raises(QueueURLError, match="SPINEWATCH_QUEUE_URL"):
        require_queue(load_settings(queue_url="amqp://host"))


def test_a_database_must_have_the_tables_of_this_version(tmp_path: Path) -> None:
    settings = load_settings(database_url=f"sqlite:///{tmp_path / 'spinewatch.sqlite'}")
    with pytest.raises(DatabaseNotReadyError):
        require_database(settings)
    migrate_database(settings)
    migrate_database(settings)
    require_database(settings)


def test_a_database_that_cannot_be_written_is_named_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = load_settings(database_url=f"sqlite:///{tmp_path / 'spinewatch.sqlite'}")
    migrate_database(settings)

    def fail(*_: object) -> None:  # as in a folder of another user, which a test that runs as root can write
        raise OperationalError("BEGIN IMMEDIATE", None, Exception("attempt to write a readonly database\n"))

    monkeypatch.setattr("sqlalchemy.orm.Session.connection", fail)
    with pytest.raises(DatabaseNotReadyError, match=r"cannot be written: .*readonly.*DATABASE_URL") as raised:
        require_database(settings)
    assert "\n" not in str(raised.value)


def test_a_database_that_cannot_be_migrated_is_named_in_one_line(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_bytes(b"not a database, but longer than its header" * 20)
    for url in (f"sqlite:///{file}", f"sqlite:///{file / 'below'}", "nonsense"):
        with pytest.raises(DatabaseNotReadyError, match="SPINEWATCH_DATABASE_URL") as raised:
            migrate_database(load_settings(database_url=url))
        assert "\n" not in str(raised.value)
