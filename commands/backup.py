"""``spinewatch backup``: a copy of the database in one file."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from commands.shared.configuration import load_settings


def backup(
    file: Annotated[Path, typer.Argument(help="The file to write; it must not exist.", show_default=False)],
) -> None:
    """Copy the database, images included, to one file; the service may run and is not disturbed."""
    settings = load_settings()
    from commands.shared.terminal_progress import terminal_progress  # noqa: PLC0415 - --help does not need it
    from store.backup import back_up  # noqa: PLC0415

    with terminal_progress() as progress:
        size = back_up(settings.database_url, file, progress)
    typer.echo(f"{file}: {size / 1e6:.1f} MB; check it with: spinewatch verify {file}")
