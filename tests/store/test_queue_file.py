import os
import subprocess
import sys
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
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
    for content in [*torn_files(file), BROKEN, b"no database" * 500]:
        for other in file.parent.iterdir():
            other.unlink()
        file.write_bytes(content)
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
