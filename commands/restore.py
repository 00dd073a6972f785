"""``spinewatch restore``: puts a backup in the place of the database."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from commands.shared.configuration import load_settings


def restore(
    file: Annotated[Path, typer.Argument(help="A backup made by `spinewatch backup`.", show_default=False)],
    replace: Annotated[
        bool,
        typer.Option("--replace", help="Replace the database; the old one is kept beside it, renamed."),
    ] = False,
) -> None:
    """Verify a backup and put it in the place of the database; refused while a service uses the database."""
    settings = load_settings()
    from commands.shared.terminal_progress import terminal_progress  # noqa: PLC0415 - --help does not need it
    from spinewatch.progress import part  # noqa: PLC0415
    from store.backup import database_file  # noqa: PLC0415
    from store.backup import restore as restore_file  # noqa: PLC0415
    from store.clock import utc_now  # noqa: PLC0415
    from store.errors import BackupError  # noqa: PLC0415
    from store.revision import REVISION  # noqa: PLC0415
    from store.verification import verify  # noqa: PLC0415

    target = database_file(settings.database_url)
    with terminal_progress() as progress:
        found = verify(file, part(progress, 0.0, 0.5))
        if found.problems:
            raise BackupError(f"{file} is not whole: {found.problems[0]}; choose another backup")
        kept = restore_file(
            settings.database_url, file, utc_now(), replace=replace, progress=part(progress, 0.5, 1.0)
        )
    if kept is not None:
        typer.echo(f"the old database is kept as {kept}")
    typer.echo(f"{target}: {found.surgeries} surgeries, {found.stages} stages")
    if found.revision != REVISION:
        typer.echo("the backup is of an earlier version; run: spinewatch db upgrade")
