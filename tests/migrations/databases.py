"""Revisions and contents of the databases of these tests."""

from typing import Any

from alembic import command
from sqlalchemy import MetaData, select

from migrations.history import config
from store.database import Database
from store.revision import current_revision


def move(database: Database, revision: str) -> None:
    with database.write() as session:
        at = config(session.connection())
        down = (current_revision(database) or "") > revision
        (command.downgrade if down else command.upgrade)(at, revision)


def contents(database: Database) -> dict[str, list[dict[str, Any]]]:
    metadata = MetaData()
    metadata.reflect(database.engine)
    with database.read() as session:
        return {
            name: [
                dict(row)
                for row in session.execute(select(table).order_by(*table.primary_key.columns)).mappings()
            ]
            for name, table in metadata.tables.items()
            if name != "alembic_version"
        }
