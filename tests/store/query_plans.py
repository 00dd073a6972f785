"""How SQLite reads what a query asks for."""

from collections.abc import Callable
from typing import Any

import pytest
from sqlalchemy import event
from sqlalchemy.orm import Session

from store.database import Database


def read_first(database: Database, read: Callable[[Session], object]) -> list[str]:
    """The first step of each query: a table of a surgery is searched, and nothing is read from end to end."""
    if database.engine.dialect.name != "sqlite":
        pytest.skip("the plans are those of SQLite")
    sent: list[tuple[str, Any]] = []

    def listener(*arguments: Any) -> None:
        sent.append((arguments[2], arguments[3]))

    event.listen(database.engine, "before_cursor_execute", listener)
    with database.read() as session:
        read(session)
    event.remove(database.engine, "before_cursor_execute", listener)
    with database.read() as session:
        connection = session.connection()
        return [
            str(connection.exec_driver_sql(f"EXPLAIN QUERY PLAN {query}", parameters).all()[0].detail)
            for query, parameters in sent
            if query.startswith("SELECT")
        ]
