"""``spinewatch verify``: whether a backup is whole."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def verify(
    file: Annotated[Path, typer.Argument(help="A backup made by `spinewatch backup`.", show_default=False)],
) -> None:
    """Read every byte of a backup: the file, its rows, references and images; exit status 1 if it is not whole."""
    from commands.shared.terminal_progress import terminal_progress  # noqa: PLC0415 - --help does not need it
    from store.verification import verify as verify_file  # noqa: PLC0415

    with terminal_progress() as progress:
        found = verify_file(file, progress)
    typer.echo(
        f"{file}: revision {found.revision}, {found.surgeries} surgeries, {found.stages} stages, {found.images} images"
        f" ({found.image_bytes / 1e6:.1f} MB)"
    )
    if not found.has_digests:
        typer.echo(
            "  it has no digests of its rows, as backups of earlier versions and databases of a service have none: the"
            " contents of its rows cannot be checked, only the structure, the images and the audit"
        )
    for problem in found.problems:
        typer.echo(f"  {problem}")
    if found.problems:
        typer.echo("the backup is not whole; choose another one")
        raise typer.Exit(1)
    typer.echo("the backup is whole")
