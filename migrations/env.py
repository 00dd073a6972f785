"""What Alembic runs for each command: the given connection and the tables of store/, in one transaction."""

from __future__ import annotations

from alembic import context

from store.tables.base import Base

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Base.metadata,
    transactional_ddl=True,
    render_as_batch=True,  # SQLite cannot alter a table in place
)
context.run_migrations()
