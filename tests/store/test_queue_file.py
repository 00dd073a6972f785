import os
import sqlite3
import subprocess
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import pytest

from store.errors import QueueURLError
from store.queue import JobQueue

BROKEN = b"SQLite format 3\0" + b"\xff" * 20_000


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "queue.sqlite"


@pytest.fixture
def queue(file: Path) -> Iterator[JobQueue]:
    queue = JobQueue(f"sqlite:///{file}")
    yield queue
    queue.close()


def works(file: Path) -> bool:
    queue = JobQueue(f"sqlite:///{file}")
    try:
        queue.enqueue("job")
        return "job" in queue.waiting()
    finally:
        queue.close()


def torn_files(file: Path) -> Iterator[bytes]:
    """Yield what a power cut may leave of a queue: each page empty, and each length cut short."""
    queue = JobQueue(f"sqlite:///{file}")
    for n in range(300):
        queue.enqueue(f"job-{n}")
    queue.close()
    whole = file.read_bytes()
    assert len(whole) > 8 * 4096
    for page in range(0, len(whole), 4096):
        yield whole[:page] + b"\0" * 4096 + whole[page + 4096 :]
        yield whole[:page] + b"\0" * 700 + whole[page + 700 :]
        yield whole[:page]
        yield whole[: page + 1000]


def test_a_file_broken_in_any_way_is_made_anew_at_the_start(file: Path) -> None:
    for content in [*torn_files(file), BROKEN, b"\0" * 9000]:
        for other in file.parent.iterdir():
            other.unlink()
        file.write_bytes(content)
        assert works(file)


def test_a_queue_without_messages_whose_first_page_is_lost_is_made_anew(file: Path) -> None:
    JobQueue(f"sqlite:///{file}").close()
    content = file.read_bytes()
    assert any(content[4096:])
    file.write_bytes(b"\0" * 4096 + content[4096:])
    assert works(file)


def other_database(file: Path, mode: str = "DELETE") -> bytes:
    """Make a database of another program; return its bytes."""
    with closing(sqlite3.connect(file)) as connection:
        connection.execute(f"PRAGMA journal_mode={mode}")
        for n in range(60):  # their definitions need several pages
            connection.execute(f"CREATE TABLE record_{n} (id INTEGER PRIMARY KEY, {'x' * 200} TEXT)")
            connection.execute(f"INSERT INTO record_{n} VALUES (1, 'record')")  # noqa: S608
            connection.commit()
    return file.read_bytes()


def is_left_alone(file: Path, content: bytes) -> bool:
    file.write_bytes(content)
    file.chmod(0o644)
    with pytest.raises(QueueURLError, match=r"no queue .*SPINEWATCH_QUEUE_URL"):
        JobQueue(f"sqlite:///{file}")
    names = [path.name for path in file.parent.iterdir()]
    return (file.read_bytes(), file.stat().st_mode & 0o777, names) == (content, 0o644, [file.name])


@pytest.mark.parametrize(
    "content",
    [
        b"x",
        b"my notes\n",
        b"no database" * 500,
        b"SQLite format 2\0" + b"\0" * 9000,
        b"\0" * 32_768 + b"\1CD001" + b"\0" * 2048,  # the image of a disk
        b"\x37\x7f\x06\x82" + b"\0" * 9000,  # a write-ahead log
    ],
)
def test_a_file_that_is_no_queue_is_left_alone(file: Path, content: bytes) -> None:
    assert is_left_alone(file, content)


def test_a_database_of_another_program_is_left_alone_however_it_is_damaged(file: Path) -> None:
    whole = other_database(file)
    assert is_left_alone(file, whole)
    for page in range(0, len(whole), 4096):
        assert is_left_alone(file, whole[:page] + b"\0" * 4096 + whole[page + 4096 :])
        assert is_left_alone(file, whole[:page] + b"\xff" * 700 + whole[page + 700 :] if page else whole)
    assert is_left_alone(file, whole[:-5000])


def test_what_another_program_has_only_in_its_write_ahead_log_is_left_alone(file: Path) -> None:
    code = (
        "import os, sqlite3, sys; c = sqlite3.connect(sys.argv[1]); c.execute('PRAGMA journal_mode=WAL');"
        "c.execute('CREATE TABLE \"a letter\" (x)'); c.commit(); os._exit(0)"
    )
    subprocess.run([sys.executable, "-c", code, str(file)], check=True)
    before = {path.name: path.read_bytes() for path in file.parent.iterdir()}
    with pytest.raises(QueueURLError, match="no queue"):
        JobQueue(f"sqlite:///{file}")
    assert {path.name: path.read_bytes() for path in file.parent.iterdir()} == before


def test_a_file_that_is_replaced_by_another_while_it_is_used_is_left_alone(
    file: Path, queue: JobQueue
) -> None:
    queue.enqueue("before")
    queue.huey.storage.close()
    file.write_bytes(b"my notes\n" * 900)
    with pytest.raises(sqlite3.DatabaseError):
        queue.enqueue("after")
    assert file.read_bytes() == b"my notes\n" * 900


def test_a_link_to_nothing_becomes_a_queue(file: Path) -> None:
    file.symlink_to(file.with_name("real.sqlite"))
    assert works(file)


def test_a_broken_write_ahead_log_is_no_obstacle(file: Path) -> None:
    code = (
        "import os, sys; from store.queue import JobQueue; queue = JobQueue('sqlite:///' + sys.argv[1])\n"
        "for n in range(50): queue.enqueue(str(n))\n"
        "os._exit(0)"
    )
    subprocess.run([sys.executable, "-c", code, str(file)], check=True)
    log = file.with_name("queue.sqlite-wal")
    content = log.read_bytes()
    for cut in range(0, len(content), 3000):
        log.write_bytes(content[:cut] + b"\xff" * 200 + content[cut + 200 :])
        assert works(file)


def test_the_broken_file_is_kept_beside_it(file: Path) -> None:
    file.write_bytes(BROKEN)
    assert works(file)
    assert file.with_name("queue.sqlite.broken").read_bytes() == BROKEN


def test_a_file_that_breaks_while_it_is_used_is_made_anew(file: Path, queue: JobQueue) -> None:
    for _ in range(3):
        queue.enqueue("before")
        queue.huey.storage.close()  # its connection knows the pages that it has read
        file.write_bytes(BROKEN)
        assert queue.huey.dequeue() is None
        queue.enqueue("after")
        assert queue.waiting() == {"after"}
        queue.huey.storage.flush_queue()


def test_processes_share_the_file_that_has_the_name(file: Path, queue: JobQueue) -> None:
    queue.enqueue("lost")
    for path in file.parent.iterdir():
        path.unlink()
    other = JobQueue(f"sqlite:///{file}")
    other.enqueue("there")
    assert queue.waiting() == {"there"}
    assert queue.length() == 1
    other.close()


def test_those_that_start_together_make_one_new_file(file: Path) -> None:
    file.write_bytes(BROKEN)
    together = threading.Barrier(6)

    def start(job: int) -> None:
        together.wait()
        queue = JobQueue(f"sqlite:///{file}")
        queue.enqueue(str(job))
        queue.close()

    with ThreadPoolExecutor(6) as pool:
        list(pool.map(start, range(6)))
    queue = JobQueue(f"sqlite:///{file}")
    assert queue.waiting() == {str(job) for job in range(6)}
    queue.close()


def test_only_the_owner_can_read_it(file: Path, queue: JobQueue) -> None:
    queue.enqueue("job")
    assert {path.stat().st_mode & 0o777 for path in file.parent.iterdir()} == {0o600}


def test_a_file_that_cannot_be_used_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for path in (tmp_path, tmp_path / "file" / "queue.sqlite"):
        with pytest.raises(QueueURLError, match=r"cannot be used: .*SPINEWATCH_QUEUE_URL"):
            JobQueue(f"sqlite:///{path}")
    assert os.listdir(tmp_path) == ["file"]
