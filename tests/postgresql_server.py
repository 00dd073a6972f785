"""A PostgreSQL server of the tests' own: nothing in it survives a power cut, and so it is fast."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

import psycopg

from tests.patience import PATIENCE_S

_OPTIONS = "-c fsync=off -c full_page_writes=off -c synchronous_commit=off -c max_wal_size=128MB"
_MEMORY = Path("/dev/shm")  # noqa: S108 - files are made in a folder with a random name
_ROOM_BYTES = 2 << 30


def programs() -> Path | None:
    """Return the folder of the server's programs, None where it is not installed."""
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"))
    on_path = shutil.which("initdb")
    return found[-1].parent if found else Path(on_path).parent if on_path else None


@contextmanager
def postgresql_server(bin_folder: Path, port: int) -> Iterator[str]:
    """Start a server on a free port and give its URL; it ends with this process, however that ends."""
    with TemporaryDirectory(prefix="spinewatch-postgresql-", dir=_memory()) as name:
        folder, run = Path(name), ["setpriv", "--pdeathsig", "INT"]
        if os.geteuid() == 0:  # the server refuses to run as root
            shutil.chown(folder, "postgres", "postgres")
            run += ["--reuid", "postgres", "--regid", "postgres", "--clear-groups"]
        data, url = f"{folder}/data", f"postgresql://root@127.0.0.1:{port}/postgres"
        initialize = f"-D {data} --username root --auth trust --no-sync".split()
        subprocess.run(
            [*run, f"{bin_folder}/initdb", *initialize], check=True, stdout=subprocess.DEVNULL, cwd=folder
        )
        arguments = f"-D {data} -h 127.0.0.1 -p {port} -c unix_socket_directories= {_OPTIONS}".split()
        with (folder / "log").open("wb") as log:
            server = subprocess.Popen(
                [*run, f"{bin_folder}/postgres", *arguments],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                cwd=folder,
            )
        try:
            _wait_until_it_answers(server, url, folder / "log")
            yield url
        finally:
            server.send_signal(signal.SIGINT)  # it ends without waiting for clients
            server.wait(PATIENCE_S)


def _memory() -> Path | None:
    """Return a folder in memory with room for the databases, where a new one costs an eighth of one on disk."""
    has_room = _MEMORY.is_dir() and shutil.disk_usage(_MEMORY).free > _ROOM_BYTES
    return _MEMORY if has_room and os.access(_MEMORY, os.W_OK) else None


def _wait_until_it_answers(server: subprocess.Popen[bytes], url: str, log: Path) -> None:
    end = time.monotonic() + PATIENCE_S
    while True:
        try:
            psycopg.connect(url, connect_timeout=5).close()
        except psycopg.OperationalError:
            assert server.poll() is None, f"the PostgreSQL server ended:\n{log.read_text()}"
            assert time.monotonic() < end, "the PostgreSQL server does not start"
            time.sleep(0.02)
        else:
            return
