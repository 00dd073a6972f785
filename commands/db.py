"""``spinewatch db``: maintenance of the database."""

from __future__ import annotations

import typer

from commands.shared.configuration import load_settings, migrate_database

cli = typer.Typer(no_args_is_help=True)


@cli.callback()
def db() -> None:
    """Maintain the database."""


@cli.command()
def upgrade() -> None:
    """Create the database, or migrate it to this version; safe to repeat."""
    migrate_database(load_settings())
    from migrations.history import head  # noqa: PLC0415 - loads SQLAlchemy, which --help does not need

    typer.echo(f"the database is at revision {head()}")
