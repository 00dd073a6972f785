"""``spinewatch audit``: whether the audit is whole, and copies of it for other systems."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from commands.shared.configuration import load_settings, require_database
from commands.shared.files import printable_name

if TYPE_CHECKING:
    from store.audit import Chain

cli = typer.Typer(no_args_is_help=True)


class Format(StrEnum):
    """Formats of a copy of the audit."""

    FHIR = "fhir"
    JSONL = "jsonl"


@cli.callback()
def audit() -> None:
    """Check the audit, or copy it."""


@cli.command()
def verify(
    file: Annotated[
        Path,
        typer.Argument(
            help="A database or a backup of one (SQLite), or a copy made by `audit export --format jsonl`.",
            show_default=False,
        ),
    ],
    expect: Annotated[
        str | None,
        typer.Option(
            help="An earlier last event as this command printed it, NUMBER:HASH; it must still be there.",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Check offline that no event was changed, put in or removed; exit status 1 if one was."""
    from store.audit_file import verify_file  # noqa: PLC0415 - --help does not need it

    chain = verify_file(file, expect)
    typer.echo(f"{file}: {chain.events} events, {_verdict(chain)}")
    if not chain.is_whole:
        raise typer.Exit(1)


@cli.command()
def export(
    file: Annotated[Path, typer.Argument(help="The file to write; it must not exist.", show_default=False)],
    form: Annotated[
        Format, typer.Option("--format", help="FHIR R4 AuditEvents, or JSON lines with the chain.")
    ] = Format.FHIR,
    surgery: Annotated[
        str | None, typer.Option(help="Only events of this surgery.", show_default=False)
    ] = None,
) -> None:
    """Copy the audit to a file that only its owner can read."""
    surgery = None if surgery is None else printable_name(surgery)
    settings = load_settings()
    require_database(settings)
    import json  # noqa: PLC0415 - --help does not need these
    import socket  # noqa: PLC0415

    from exports.audit_fhir import export as fhir_bundle  # noqa: PLC0415
    from store.audit import all_events  # noqa: PLC0415
    from store.database import Database  # noqa: PLC0415
    from store.errors import NotFoundError  # noqa: PLC0415
    from store.private_file import private_file  # noqa: PLC0415

    database = Database(settings.database_url)
    try:
        with database.read() as session:
            if surgery is not None and next(iter(all_events(session, surgery)), None) is None:
                raise NotFoundError("surgery")
        with database.read() as session, private_file(file) as stream:
            events = all_events(session, surgery)
            if form is Format.FHIR:
                stream.write(fhir_bundle(events, socket.gethostname()))
            else:
                for event in events:
                    stream.write(f"{json.dumps(event.model_dump(mode='json'), sort_keys=True)}\n".encode())
    finally:
        database.close()
    typer.echo(str(file))


def _verdict(chain: Chain) -> str:
    if chain.is_whole:
        return f"whole; last event {chain.last}:{chain.head}"
    return f"broken at {chain.broken_at}: {chain.reason}"
