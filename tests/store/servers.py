"""URLs of queues on each storage, for tests; Redis and PostgreSQL where they are installed."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.backends import new_database, new_redis, require_postgresql

STORAGES = ("sqlite", "redis", "postgresql")


@contextmanager
def queue_url(storage: str, folder: Path) -> Iterator[str]:
    """Give the URL of an empty queue of the test's own; skip where its server is not installed."""
    if storage == "sqlite":
        yield f"sqlite:///{folder / 'queue.sqlite'}"
    elif storage == "redis":
        if shutil.which("redis-server") is None:
            pytest.skip("Redis is not installed")
        with new_redis(folder) as url:
            yield url
    else:
        require_postgresql()
        with new_database(folder, tables=False, storage="postgresql") as url:
            yield url
