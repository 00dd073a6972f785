"""What a killed process has left is removed by the next one, and what a living one writes is not."""

import subprocess
import sys
from pathlib import Path

from store.partial_file import partial_file

WRITER = """
import sys
from pathlib import Path
from store.partial_file import partial_file
with partial_file(Path(sys.argv[1]), ("-journal",)) as (partial, _):
    partial.with_name(partial.name + "-journal").write_bytes(b"half")
    print(partial, flush=True)
    sys.stdin.read()
"""


def writer(target: Path) -> tuple["subprocess.Popen[str]", Path]:
    """Return a process that is writing a file, and the file."""
    process = subprocess.Popen(
        [sys.executable, "-c", WRITER, str(target)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[2],
    )
    assert process.stdout is not None
    return process, Path(process.stdout.readline().strip())


def test_a_file_is_for_its_owner_alone_and_removed_at_the_end(tmp_path: Path) -> None:
    with partial_file(tmp_path / "x") as (partial, _):
        assert partial.stat().st_mode & 0o777 == 0o600
        assert list(tmp_path.iterdir()) == [partial]
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_has_got_its_name_is_kept(tmp_path: Path) -> None:
    with partial_file(tmp_path / "x") as (partial, _):
        partial.write_bytes(b"content")
        partial.rename(tmp_path / "x")
    assert (tmp_path / "x").read_bytes() == b"content"


def test_what_a_killed_process_left_is_removed_for_whatever_target(tmp_path: Path) -> None:
    process, partial = writer(tmp_path / "monday")
    process.kill()
    process.communicate()
    assert partial.exists()
    with partial_file(tmp_path / "tuesday", ("-journal",)) as (own, _):
        assert list(tmp_path.iterdir()) == [own]


def test_what_a_living_process_writes_and_other_files_are_kept(tmp_path: Path) -> None:
    (tmp_path / ".x.partial-1").write_bytes(b"of another program")
    process, partial = writer(tmp_path / "x")
    with partial_file(tmp_path / "x", ("-journal",)):
        assert partial.exists()
    assert partial.with_name(partial.name + "-journal").exists()
    process.communicate("")
    assert [path.name for path in tmp_path.iterdir()] == [".x.partial-1"]
