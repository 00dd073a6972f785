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
        restored = restore_file(
            settings.database_url, file, utc_now(), replace=replace, progress=part(progress, 0.5, 1.0)
        )
    if restored.kept is not None:
        typer.echo(f"the old database is kept as {restored.kept}")
    if restored.revoked:
        typer.echo(f"revoked in the old database and so here, too: keys {', '.join(restored.revoked)}")
    if not restored.knows_revocations:
        typer.echo("keys that were revoked after the backup are valid again; check: spinewatch key list")
    typer.echo(f"{target}: {found.surgeries} surgeries, {found.stages} stages")
    if found.revision != REVISION:
        typer.echo("the backup is of an earlier version, and its audit does not say that it was restored")
        typer.echo("run: spinewatch db upgrade")
        return
    _record(settings.database_url, file, restored.revoked)


def _record(database_url: str, file: Path, revoked: tuple[str, ...]) -> None:
    """Append to the audit that the database was restored, by whom and from which backup."""
    import hashlib  # noqa: PLC0415 - --help does not need it

    from commands.shared.key_making import command_actor  # noqa: PLC0415
    from store import events  # noqa: PLC0415
    from store.clock import utc_now  # noqa: PLC0415
    from store.database import Database  # noqa: PLC0415

    with file.open("rb") as stream:
        digest = hashlib.file_digest(stream, "sha256").hexdigest()
    again = f"; keys revoked again: {', '.join(revoked)}" if revoked else ""
    detail = f"from the backup with SHA-256 {digest}{again}"
    database = Database(database_url)
    try:
        with database.write() as session:
            action = events.Action.DATABASE_RESTORED
            events.append(session, utc_now(), command_actor("restore"), action, "database", detail=detail)
    finally:
        database.close()
