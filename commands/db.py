"""``spinewatch db``: maintenance of the database."""

from __future__ import annotations

from typing import Annotated

import typer

from commands.shared.configuration import load_settings, migrate_database

cli = typer.Typer(no_args_is_help=True)


@cli.callback()
def db() -> None:
    """Maintain the database."""


@cli.command()
def upgrade(
    copy: Annotated[
        bool, typer.Option(help="Copy an SQLite database beside itself before it is migrated.")
    ] = True,
) -> None:
    """Create the database, or migrate it to this version; safe to repeat."""
    kept = migrate_database(load_settings(), keep_copy=copy)
    from migrations.history import head  # noqa: PLC0415 - loads SQLAlchemy, which --help does not need

    if kept is not None:
        typer.echo(f"the database as it was before is kept as {kept}")
    typer.echo(f"the database is at revision {head()}")
