"""``spinewatch db``: the database's tables."""

from __future__ import annotations

import typer

from commands.shared.configuration import load_settings

cli = typer.Typer(no_args_is_help=True)


@cli.callback()
def db() -> None:
    """Look after the database."""


@cli.command()
def upgrade() -> None:
    """Make the database, or bring its tables to this version; nothing is lost, and twice does no harm."""
    from migrations.history import head  # noqa: PLC0415 - --help can do without
    from migrations.history import upgrade as upgrade_record  # noqa: PLC0415

    upgrade_record(load_settings().database_url)
    typer.echo(f"the database is at revision {head()}")
