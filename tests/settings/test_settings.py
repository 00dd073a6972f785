from pathlib import Path

import pytest
from pydantic import ValidationError

from settings import Settings
from tests.paths import PROJECT

OPERATIONS = PROJECT / "docs" / "operations.md"


@pytest.fixture(autouse=True)
def plain_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in Settings.model_fields:
        monkeypatch.delenv(f"SPINEWATCH_{name.upper()}", raising=False)


@pytest.mark.parametrize("name", Settings.model_fields)
def test_every_setting_is_in_the_manual_with_its_default(name: str) -> None:
    (row,) = [
        line
        for line in OPERATIONS.read_text().splitlines()
        if line.startswith(f"| `SPINEWATCH_{name.upper()}`")
    ]
    default = Settings.model_fields[name].default
    if default is not None:
        assert f"`{default}`" in row


def test_the_manual_has_no_setting_that_does_not_exist() -> None:
    rows = [line for line in OPERATIONS.read_text().splitlines() if line.startswith("| `SPINEWATCH_")]
    assert len(rows) == len(Settings.model_fields)


def test_a_child_process_gets_the_same_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    settings = Settings(
        port=9000,
        lease_seconds=2.5,
        queue_url="redis://127.0.0.1:6379/0",
        templates=Path("t.npz"),
        log_format="json",
    )
    for name, value in settings.environment().items():
        monkeypatch.setenv(name, value)
    assert Settings() == settings


@pytest.mark.parametrize(
    ("database", "queue"),
    [
        ("sqlite:////data/x.sqlite", "sqlite:////data/x-queue.sqlite"),
        ("sqlite:///var/x.sqlite", "sqlite:///var/x-queue.sqlite"),
        ("sqlite:///x", "sqlite:///x-queue.sqlite"),
        ("postgresql+psycopg://host/name", "sqlite:///var/spinewatch-queue.sqlite"),
    ],
)
def test_the_queue_is_beside_the_database(database: str, queue: str) -> None:
    assert Settings(database_url=database).queue == queue
    assert Settings(database_url=database, queue_url="redis://host").queue == "redis://host"


def test_settings_do_not_change_and_are_checked() -> None:
    with pytest.raises(ValidationError):
        Settings(port=0)
    with pytest.raises(ValidationError):
        Settings().port = 1
