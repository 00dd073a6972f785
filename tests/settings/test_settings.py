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
    settings = Settings(port=9000, lease_seconds=2.5, queue_path=Path("/tmp/x.sqlite"), log_format="json")  # noqa: S108
    for name, value in settings.environment().items():
        monkeypatch.setenv(name, value)
    assert Settings() == settings


def test_the_bell_hangs_beside_the_database() -> None:
    assert Settings(database_url="sqlite:////data/x.sqlite").queue_file == Path("/data/x-bell.sqlite")
    assert Settings(queue_path=Path("b.sqlite")).queue_file == Path("b.sqlite")
    assert Settings(database_url="postgresql://host/name").queue_file != Path()


def test_settings_do_not_change_and_are_checked() -> None:
    with pytest.raises(ValidationError):
        Settings(port=0)
    with pytest.raises(ValidationError):
        Settings().port = 1
