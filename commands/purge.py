"""``spinewatch purge``: removes surgeries for good, after an export of each."""

from __future__ import annotations

import getpass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from commands.shared.configuration import load_settings, require_database
from commands.shared.files import printable_name
from spinewatch.errors import SpinewatchError

if TYPE_CHECKING:
    from contract.event import Actor
    from store.database import Database
    from store.retention import Purged


class PurgeError(SpinewatchError):
    """The options of a purge contradict each other, or it was not confirmed."""

    code = "purge"


def purge(
    reason: Annotated[
        str,
        typer.Option(help="Why, for the record; never a name.", show_default=False),
    ],
    surgery: Annotated[
        str | None, typer.Argument(help="Identifier of the surgery.", show_default=False)
    ] = None,
    older_than: Annotated[
        int | None,
        typer.Option(
            "--older-than",
            min=1,
            max=36_500,
            metavar="DAYS",
            help="Every surgery without a stage in the last DAYS days.",
            show_default=False,
        ),
    ] = None,
    export_to: Annotated[
        Path, typer.Option("--export-to", help="Folder for the export of each case, case-SURGERY.zip.")
    ] = Path(),
    no_export: Annotated[bool, typer.Option("--no-export", help="Remove without an export.")] = False,
    no_vacuum: Annotated[
        bool,
        typer.Option("--no-vacuum", help="Do not rebuild the file, during which nobody can write (SQLite)."),
    ] = False,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask for the case number.")] = False,
) -> None:
    """Remove surgeries with their results and images; a tombstone and the audit stay."""
    if (surgery is None) == (older_than is None):
        raise PurgeError("name one surgery, or give --older-than")
    reason = printable_name(reason.strip())
    if not reason:
        raise PurgeError("give a reason")
    surgery = None if surgery is None else printable_name(surgery)
    settings = load_settings()
    require_database(settings)
    from datetime import timedelta  # noqa: PLC0415 - --help does not need these

    from contract.event import Actor, ActorKind  # noqa: PLC0415
    from store import retention  # noqa: PLC0415
    from store.clock import utc_now  # noqa: PLC0415
    from store.database import Database  # noqa: PLC0415

    folder = None if no_export else export_to
    actor = Actor(kind=ActorKind.COMMAND, name=f"spinewatch purge by {getpass.getuser()}"[:128])
    database = Database(settings.database_url)
    try:
        with database.read() as session:
            age = timedelta(days=older_than or 0)
            found = [surgery] if surgery is not None else retention.expired(session, utc_now(), age)
        if not found:
            typer.echo("no surgery is that old")
        for identifier in found:
            if not yes:
                _confirm(database, identifier)
            removed, file = _purge(database, identifier, reason, folder, actor)
            kept = "no export" if file is None else f"export {file}"
            typer.echo(f"{identifier}: {removed.stages} stages, {removed.images} images removed; {kept}")
        if not retention.erase(database, vacuum=not no_vacuum):
            typer.echo(
                "remains may be in the files of the database, which others use: stop the service and run"
                " `spinewatch purge --older-than` again, or, on a server, see docs/operations.md",
                err=True,
            )
    finally:
        database.close()


def _confirm(database: Database, surgery_id: str) -> None:
    """Raise ``PurgeError`` unless the case number is typed."""
    from store.errors import NotFoundError  # noqa: PLC0415 - --help does not need it
    from store.tables.surgeries import Surgery  # noqa: PLC0415

    with database.read() as session:
        row = session.get(Surgery, surgery_id)
    if row is None:
        raise NotFoundError("surgery")
    if typer.prompt(f"{surgery_id}: type its case number to remove it for good") != row.reference:
        raise PurgeError("that is not its case number; nothing was removed")


def _purge(
    database: Database, surgery_id: str, reason: str, folder: Path | None, actor: Actor
) -> tuple[Purged, Path | None]:
    """Export and remove a surgery in one transaction."""
    from importlib.metadata import version  # noqa: PLC0415 - --help does not need these

    from store import retention  # noqa: PLC0415
    from store.case_file import write_case  # noqa: PLC0415
    from store.clock import utc_now  # noqa: PLC0415
    from store.private_file import private_file  # noqa: PLC0415

    now = utc_now()
    with database.write(patient=True) as session:
        if folder is None:
            return retention.purge(session, surgery_id, reason, None, now, actor), None
        file = folder / f"case-{surgery_id}.zip"
        with private_file(file) as stream:
            digest = write_case(session, surgery_id, stream, version("spinewatch"), now)
        return retention.purge(session, surgery_id, reason, digest, now, actor), file
