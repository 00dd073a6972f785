"""``spinewatch key`` as a process."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from migrations.history import upgrade

KEY = re.compile(r"sw_[a-z2-7]{8}_[a-z2-7]{52}\n")


def run(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    url = f"sqlite:///{folder / 'spinewatch.sqlite'}"
    return subprocess.run(
        [sys.executable, "-m", "commands", "key", *arguments],
        env={**os.environ, "SPINEWATCH_DATABASE_URL": url},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a database that has the tables."""
    upgrade(f"sqlite:///{tmp_path / 'spinewatch.sqlite'}")
    return tmp_path


def test_a_key_is_made_listed_and_revoked(folder: Path) -> None:
    made = run(
        folder, "create", "cart 1", "--scope", "capture:write", "--scope", "stage:read", "--expires", "30"
    )
    assert made.returncode == 0, made.stderr
    assert KEY.fullmatch(made.stdout)
    assert "shown only here" in made.stderr
    prefix = made.stdout.split("_")[1]
    listed = run(folder, "list").stdout
    assert re.search(rf"^{prefix}  cart 1  capture:write stage:read  valid until \S+Z  never$", listed, re.M)
    assert made.stdout.strip().rpartition("_")[2] not in listed
    for name in (prefix, f"sw_{prefix}", made.stdout.strip()):
        done = run(folder, "revoke", name)
        assert (done.returncode, done.stdout) == (0, f"key {prefix} for 'cart 1' is refused from now on\n")
    assert re.search(rf"^{prefix}  cart 1 .* revoked ", run(folder, "list").stdout, re.M)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("create", "cart", "--scope", "everything"), "capture:write, stage:read, correct:write, admin"),
        (("create", "cart", "--scope", "admin", "--scope", "admin"), "each of these once"),
        (("create", "c\u00e1rt", "--scope", "admin"), "cannot be the name"),
        (("create", "cart", "--scope", "admin", "--expires", "0"), "1 to 3650"),
        (("revoke", "no-prefix"), "spinewatch key list"),
        (("revoke", "aaaaaaaa"), "no such key"),
    ],
)
def test_what_makes_no_sense_is_one_line(folder: Path, arguments: tuple[str, ...], words: str) -> None:
    done = run(folder, *arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert words in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_without_tables_the_way_out_is_named(tmp_path: Path) -> None:
    assert "spinewatch db upgrade" in run(tmp_path, "list").stderr
    assert list(tmp_path.iterdir()) == []
