"""Changes to a database by somebody who gets round its triggers."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from sqlalchemy import text
from sqlalchemy.orm import Session

from store.database import Database


@contextmanager
def without_triggers(url: str, table: str) -> Iterator[Session]:
    """Give a session that writes while a table has no triggers."""
    database = Database(url)
    try:
        with database.write() as session:
            if database.engine.dialect.name != "sqlite":
                session.execute(text(f"ALTER TABLE {table} DISABLE TRIGGER USER"))
                yield session
                session.execute(text(f"ALTER TABLE {table} ENABLE TRIGGER USER"))
                return
            query = text("SELECT name, sql FROM sqlite_master WHERE type = 'trigger' AND tbl_name = :table")
            triggers = session.execute(query, {"table": table}).all()
            for name, _ in triggers:
                session.execute(text(f"DROP TRIGGER {name}"))
            yield session
            for _, statement in triggers:
                session.connection().exec_driver_sql(statement)
    finally:
        database.close()
