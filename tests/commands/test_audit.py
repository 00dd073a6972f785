"""``spinewatch audit`` and ``spinewatch purge`` as processes."""

import json
import os
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest

from migrations.history import upgrade
from store.database import Database
from tests.store.builders import new_stage, new_surgery


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "commands", *arguments],
        env={**os.environ, "SPINEWATCH_DATABASE_URL": f"sqlite:///{folder / 'x.sqlite'}"},
        capture_output=True,
        stdin=subprocess.DEVNULL,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.fixture
def surgery(tmp_path: Path) -> str:
    upgrade(f"sqlite:///{tmp_path / 'x.sqlite'}")
    database = Database(f"sqlite:///{tmp_path / 'x.sqlite'}")
    surgery = new_surgery(database)
    new_stage(database, surgery)
    database.close()
    database.checkpoint()
    return surgery


def test_the_audit_is_verified_and_copied(tmp_path: Path, surgery: str) -> None:
    lines, fhir = str(tmp_path / "audit.jsonl"), str(tmp_path / "audit.json")
    assert run(tmp_path, "audit", "export", lines, "--format", "jsonl", "--surgery", surgery).returncode == 0
    assert len(Path(lines).read_text().splitlines()) == 2
    assert run(tmp_path, "audit", "export", fhir).returncode == 0
    assert len(json.loads(Path(fhir).read_text())["entry"]) == 3
    again = run(tmp_path, "audit", "export", fhir)
    assert (again.returncode, len(again.stderr.splitlines())) == (2, 1)
    whole = run(tmp_path, "audit", "verify", str(tmp_path / "x.sqlite"))
    assert (whole.returncode, "3 events, whole; last event 3:" in whole.stdout) == (0, True)
    kept = whole.stdout.split()[-1]
    with closing(sqlite3.connect(tmp_path / "x.sqlite")) as connection:
        connection.execute("DROP TRIGGER events_no_update")
        connection.execute("UPDATE events SET actor_name = 'x' WHERE seq = 2")
        connection.commit()
    broken = run(tmp_path, "audit", "verify", str(tmp_path / "x.sqlite"), "--expect", kept)
    assert (broken.returncode, "broken at 2" in broken.stdout) == (1, True)


def test_old_surgeries_are_purged(tmp_path: Path, surgery: str) -> None:
    options = ("purge", "--older-than", "1", "--reason", "retention", "--no-export")
    asked = run(tmp_path, *options)
    assert asked.returncode != 0
    done = run(tmp_path, *options, "--yes")
    assert (done.returncode, done.stdout.count(surgery)) == (0, 1)
    assert "no surgery is that old" in run(tmp_path, *options, "--yes").stdout


@pytest.mark.parametrize(
    "options", [(), ("x", "--older-than", "1"), ("none", "--yes"), ("none", "--yes", "--export-to", "/none")]
)
def test_a_purge_that_is_impossible_is_one_line(
    tmp_path: Path, surgery: str, options: tuple[str, ...]
) -> None:
    done = run(tmp_path, "purge", *options, "--reason", "x")
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert list(tmp_path.glob("*.zip*")) == []


def test_what_is_no_audit_is_refused(tmp_path: Path, surgery: str) -> None:
    (tmp_path / "empty.jsonl").touch()
    for file in (str(tmp_path / "empty.jsonl"), "/dev/null"):
        empty = run(tmp_path, "audit", "verify", file)
        assert (empty.returncode, empty.stdout, len(empty.stderr.splitlines())) == (2, "", 1)
    copy = tmp_path / "audit.json"
    missing = run(tmp_path, "audit", "export", str(copy), "--surgery", f"{surgery}x")
    assert (missing.returncode, missing.stdout) == (2, "")
    assert "no such surgery" in missing.stderr
    assert not copy.exists()


def test_an_age_that_no_surgery_has_is_refused(tmp_path: Path, surgery: str) -> None:
    refused = run(tmp_path, "purge", "--older-than", "1000000", "--reason", "a", "--yes")
    assert (refused.returncode, len(refused.stderr.splitlines())) == (2, 1)
    oldest = run(tmp_path, "purge", "--older-than", "36500", "--reason", "a", "--yes")
    assert (oldest.returncode, "no surgery is that old" in oldest.stdout) == (0, True)
