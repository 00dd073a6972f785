import time
from pathlib import Path

import pytest
from pydantic import ValidationError

from settings import Settings, unknown_variables
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
        ("postgresql+psycopg://host/name", "postgresql+psycopg://host/name"),
    ],
)
def test_the_queue_is_beside_the_database(database: str, queue: str) -> None:
    assert Settings(database_url=database).queue == queue
    assert Settings(database_url=database, queue_url="redis://host").queue == "redis://host"


@pytest.mark.parametrize("made", [True, False])
@pytest.mark.parametrize(
    "queue",
    ["{folder}/x.sqlite", "{folder}/y/../x.sqlite", "x.sqlite", "link", "link/x.sqlite", "x.sqlite-wal"],
)
def test_the_queue_is_not_the_database(
    queue: str, made: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "y").mkdir()
    (tmp_path / "link").symlink_to(tmp_path if queue.startswith("link/") else tmp_path / "x.sqlite")
    if made:
        (tmp_path / "x.sqlite").touch()
    url = f"sqlite:///{queue.format(folder=tmp_path)}"
    for database in (f"sqlite:///{tmp_path / 'x.sqlite'}", "sqlite:///x.sqlite"):
        with pytest.raises(ValidationError, match="give the queue a file of its own"):
            Settings(database_url=database, queue_url=url)


@pytest.mark.parametrize(
    ("database", "queue"),
    [
        ("sqlite:///x.sqlite", "sqlite:///x.sqlite.queue"),
        ("sqlite:///x.sqlite", "redis://host/x.sqlite"),
        ("sqlite:///x.sqlite", "nonsense"),
        ("nonsense", "sqlite:///x.sqlite"),
        ("postgresql://host/x", "postgresql://host/x"),
        ("postgresql://host/x", "sqlite:///x"),
    ],
)
def test_another_queue_is_taken(database: str, queue: str) -> None:
    assert Settings(database_url=database, queue_url=queue).queue == queue


def test_settings_do_not_change_and_are_checked() -> None:
    with pytest.raises(ValidationError):
        Settings(port=0)
    with pytest.raises(ValidationError):
        Settings().port = 1


@pytest.mark.parametrize(
    ("name", "nearest"),
    [
        ("SPINEWATCH_PROT", "SPINEWATCH_PORT"),
        ("SPINEWATCH_DATABASE", "SPINEWATCH_DATABASE_URL"),
        ("SPINEWATCH_MAX_UPLOAD_BYTE", "SPINEWATCH_MAX_UPLOAD_BYTES"),
        ("SPINEWATCH_QQQ", None),
    ],
)
def test_a_misspelt_setting_is_named_with_the_nearest(name: str, nearest: str | None) -> None:
    known = ["SPINEWATCH_PORT", "SPINEWATCH_KEY", "spinewatch_port", "PATH", "OTHER_SPINEWATCH_PORT"]
    assert unknown_variables([*known, name]) == {name: nearest}


OPAQUE = [
    "1", "17", "17a", "A1", "2026-0417", "2026/0417", "case 17", "CASE17", "OP 17", "SAMPLE-D1", "case-1a2b3c4d",
    "1/2/3", "KH.26/0417b", "OR4_2026_17", "P-00123", "b1ba4cf2-7b67-4f14-9a35-dcbacafeabcd", "0" * 64,
]  # fmt: skip
NAMES = [
    "Anna", "Anna Smith", "Smith 1970", "Smith1970", "1970Smith", "17-Smith", "Smith, 17", "17/Anna/3", "Kim Lee 7",
    "M\u00fcller 3", "case", "case Anna", "caseanna1", "missing", "deadbeef", "a1b2Anna", "17 ", " 17", "--", "1--2",
    "17\n",
]  # fmt: skip


@pytest.mark.parametrize(("references", "taken"), [(OPAQUE, True), (NAMES, False)])
def test_the_usual_pattern_takes_numbers_and_no_names(references: list[str], taken: bool) -> None:
    pattern = Settings().case_number
    assert {reference for reference in references if bool(pattern.fullmatch(reference)) is not taken} == set()


@pytest.mark.parametrize(
    "part", ["a", "1", "a1", "1a", "ab1c ", "a1b2-", "1 ", "a-", "0123456789abcdef-", "abcd"]
)
def test_no_reference_keeps_the_usual_pattern_busy(part: str) -> None:
    pattern = Settings().case_number
    start = time.process_time()
    assert not pattern.fullmatch((part * 2000)[:2000] + "!")
    assert time.process_time() - start < 1.0


def test_a_pattern_that_is_none_is_refused() -> None:
    with pytest.raises(ValidationError, match="not a regular expression"):
        Settings(reference_pattern="(")


def test_a_site_sets_its_own_pattern() -> None:
    assert Settings(reference_pattern="K[0-9]{4}").case_number.fullmatch("K0417")
    assert not Settings(reference_pattern="K[0-9]{4}").case_number.fullmatch("2026-0417")


NUMBERS = [name for name, field in Settings.model_fields.items() if field.annotation in {int, float}]


@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("value", ["nan", "inf", "-inf", "1e30", "1" + "0" * 20, "-1"])
def test_every_number_has_limits(name: str, value: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(f"SPINEWATCH_{name.upper()}", value)
    with pytest.raises(ValidationError, match=name):
        Settings()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("database_url", "sqlite://"),
        ("queue_url", "sqlite:///:memory:"),
        ("allowed_hosts", "http://foo"),
        ("allowed_origins", "dashboard.example"),
        ("trusted_proxies", "*"),
        ("reference_pattern", "(?=K)K[0-9]+"),
    ],
)
def test_a_text_that_can_never_work_is_refused(name: str, value: str) -> None:
    with pytest.raises(ValidationError, match=name):
        Settings.model_validate({name: value})
