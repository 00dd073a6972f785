"""URLs of queues on each storage, for tests; Redis and PostgreSQL where a server runs."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest
from sqlalchemy import make_url

STORAGES = ("sqlite", "redis", "postgresql")
REDIS = os.environ.get("TEST_REDIS_URL", "redis://127.0.0.1:6379")
POSTGRESQL = os.environ.get("TEST_POSTGRESQL_URL", "postgresql://root@127.0.0.1:5432/test")


@contextmanager
def queue_url(storage: str, folder: Path) -> Iterator[str]:
    """Give the URL of an empty queue of the test's own; skip where its server does not run."""
    if storage == "sqlite":
        yield f"sqlite:///{folder / 'queue.sqlite'}"
    elif storage == "redis":
        yield from _redis()
    else:
        yield from _postgresql()


def _redis() -> Iterator[str]:
    redis: Any = pytest.importorskip("redis", reason="the package redis is not installed")
    number = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw")) % 8 + 8
    client = redis.Redis.from_url(f"{REDIS}/{number}")
    try:
        client.flushdb()
        yield f"{REDIS}/{number}"
        client.flushdb()
    except redis.exceptions.ConnectionError:
        pytest.skip(f"no Redis server at {REDIS}")
    finally:
        client.close()


def _postgresql() -> Iterator[str]:
    psycopg: Any = pytest.importorskip("psycopg", reason="the package psycopg is not installed")
    schema = f"queue_{uuid4().hex[:12]}"
    try:
        connection = psycopg.connect(POSTGRESQL, connect_timeout=2, autocommit=True)
    except psycopg.OperationalError:
        pytest.skip(f"no PostgreSQL server at {POSTGRESQL}")
    with connection:
        connection.execute(f"CREATE SCHEMA {schema}")
    url = make_url(POSTGRESQL).update_query_dict({"options": f"-csearch_path={schema}"})
    yield url.render_as_string(hide_password=False)
    with psycopg.connect(POSTGRESQL, autocommit=True) as connection:
        connection.execute(f"DROP SCHEMA {schema} CASCADE")
