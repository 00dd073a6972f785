"""``spinewatch key``: API keys of the HTTP API, made, listed and revoked on the machine of the database."""

from __future__ import annotations

import re
import sys
from typing import TYPE_CHECKING, Annotated

import typer

from commands.shared.configuration import load_settings, require_database
from spinewatch.errors import ParameterError

if TYPE_CHECKING:
    from datetime import datetime

    from contract.key import NewKey
    from store.tables.access import ApiKey

_SCOPES = "capture:write, stage:read, correct:write, admin"
_MAX_LISTED = 10_000
_PREFIX = re.compile(r"(?:sw_)?([a-z2-7]{8})(?:_[a-z2-7]{0,52})?", re.ASCII)

cli = typer.Typer(no_args_is_help=True)


@cli.callback()
def key() -> None:
    """Make, list and revoke the API keys of a service."""


@cli.command()
def create(
    name: Annotated[str, typer.Argument(help="What the key is for, for example 'cart 1'.")],
    scope: Annotated[list[str], typer.Option(help=f"What it permits; may be repeated: {_SCOPES}.")],
    expires: Annotated[
        int | None, typer.Option(min=1, max=3650, help="Days until it is refused.", show_default="never")
    ] = None,
) -> None:
    """Make a key and print it; only its SHA-256 is stored, so that it cannot be shown again."""
    new = _new_key(name, scope, expires)
    settings = load_settings()
    require_database(settings)
    from commands.shared.key_making import make_key  # noqa: PLC0415 - loads SQLAlchemy, which --help does not need

    made = make_key(settings.database_url, new, "key create")
    typer.echo(made)
    note = "" if expires is None else f"; it expires in {expires} days"
    typer.echo(f"key {made.split('_')[1]} for {name!r}: keep it, it is shown only here{note}", err=True)


@cli.command("list")
def list_keys() -> None:
    """List all keys, also revoked and expired ones, oldest first."""
    settings = load_settings()
    require_database(settings)
    from store import keys  # noqa: PLC0415 - loads SQLAlchemy, which --help does not need
    from store.clock import utc_now  # noqa: PLC0415
    from store.database import Database  # noqa: PLC0415
    from store.page import PageRequest  # noqa: PLC0415

    database = Database(settings.database_url)
    try:
        with database.read() as session:
            found = keys.listed(session, PageRequest(_MAX_LISTED, "created_at")).items
    finally:
        database.close()
    now = utc_now()
    rows = [("prefix", "name", "scopes", "state", "last used")]
    for row in found:
        used = "never" if row.last_used_at is None else _text(row.last_used_at)
        rows.append((row.prefix, row.name, " ".join(row.scopes), _state(row, now), used))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for cells in rows:
        line = "  ".join(cell.ljust(width) for cell, width in zip(cells, widths, strict=True))
        sys.stdout.write(f"{line.rstrip()}\n")


@cli.command()
def revoke(
    prefix: Annotated[str, typer.Argument(help="Prefix of the key, as `spinewatch key list` shows it.")],
) -> None:
    """Refuse a key, and every session made from it, from now on."""
    match = _PREFIX.fullmatch(prefix)
    if match is None:
        raise ParameterError("that is no prefix of a key; take it from: spinewatch key list")
    settings = load_settings()
    require_database(settings)
    from commands.shared.key_making import command_actor  # noqa: PLC0415 - loads SQLAlchemy, which --help does not need
    from store import keys  # noqa: PLC0415
    from store.clock import utc_now  # noqa: PLC0415
    from store.database import Database  # noqa: PLC0415

    database = Database(settings.database_url)
    try:
        with database.write() as session:
            row = keys.revoke(session, match[1], utc_now(), command_actor("key revoke"))
    finally:
        database.close()
    typer.echo(f"key {row.prefix} for {row.name!r} is refused from now on")


def _new_key(name: str, scopes: list[str], expires: int | None) -> NewKey:
    from pydantic import ValidationError  # noqa: PLC0415 - --help does not need them

    from contract.key import NewKey  # noqa: PLC0415

    try:
        return NewKey.model_validate({"name": name, "scopes": scopes, "expires_in_days": expires})
    except ValidationError as error:
        field = str(error.errors()[0]["loc"][0]) if error.errors()[0]["loc"] else "scopes"
        raise ParameterError(
            {
                "name": f"{name!r} cannot be the name of a key; use up to 64 letters, digits, spaces, dots, dashes and"
                " underscores",
                "scopes": f"--scope takes each of these once: {_SCOPES}",
                "expires_in_days": "--expires takes 1 to 3650 days; leave it out for a key that stays valid",
            }[field]
        ) from error


def _state(row: ApiKey, now: datetime) -> str:
    if row.revoked_at is not None:
        return f"revoked {_text(row.revoked_at)}"
    if row.expires_at is None:
        return "valid"
    return (
        f"valid until {_text(row.expires_at)}" if now < row.expires_at else f"expired {_text(row.expires_at)}"
    )


def _text(time: datetime) -> str:
    return time.strftime("%Y-%m-%dT%H:%MZ")
