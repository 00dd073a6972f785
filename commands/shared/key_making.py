"""API keys that commands make in the database of a service."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from commands.shared.exposure import is_loopback

if TYPE_CHECKING:
    from contract.event import Actor
    from contract.key import NewKey
    from settings import Settings

FIRST_NAME = "first key"
_TEMPORARY_DAYS = 1


def command_actor(command: str) -> Actor:
    """Return the actor of a command, with the user of the operating system who runs it."""
    import getpass  # noqa: PLC0415 - --help does not need them

    from contract.event import Actor, ActorKind  # noqa: PLC0415

    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # a user without a name, as in containers
        user = "unknown"
    return Actor(kind=ActorKind.COMMAND, name=f"spinewatch {command} by {user}"[:128])


def make_key(database_url: str, new: NewKey, command: str) -> str:
    """Make a key in a database that has the tables of this version; return the whole key."""
    from store import keys  # noqa: PLC0415 - --help does not need them
    from store.clock import utc_now  # noqa: PLC0415
    from store.database import Database  # noqa: PLC0415

    database = Database(database_url)
    try:
        with database.write() as session:
            return keys.add(session, new, utc_now(), command_actor(command))[1]
    finally:
        database.close()


def make_first_key(settings: Settings) -> str | None:
    """Make a key with every scope for a service on this machine alone; None if a valid one exists."""
    from contract.key import NewKey, Scope  # noqa: PLC0415 - --help does not need them

    if not is_loopback(settings.host) or has_valid_key(settings.database_url):
        return None
    return make_key(settings.database_url, NewKey(name=FIRST_NAME, scopes=[Scope.ADMIN]), "run")


def has_valid_key(database_url: str) -> bool:
    """Return whether a database has a key that can be used."""
    from store import keys  # noqa: PLC0415 - --help does not need them
    from store.clock import utc_now  # noqa: PLC0415
    from store.database import Database  # noqa: PLC0415

    database = Database(database_url)
    try:
        with database.read() as session:
            return keys.any_valid(session, utc_now())
    finally:
        database.close()


@contextmanager
def temporary_key(database_url: str, name: str) -> Iterator[str]:
    """Make a key with every scope, and revoke it at the end; if that is prevented, it expires within a day."""
    from sqlalchemy.exc import SQLAlchemyError  # noqa: PLC0415 - --help does not need them

    from contract.key import NewKey, Scope  # noqa: PLC0415
    from store import keys  # noqa: PLC0415
    from store.clock import utc_now  # noqa: PLC0415
    from store.database import Database  # noqa: PLC0415

    new = NewKey(name=name, scopes=[Scope.ADMIN], expires_in_days=_TEMPORARY_DAYS)
    key = make_key(database_url, new, name)
    try:
        yield key
    finally:
        database = Database(database_url)
        with suppress(SQLAlchemyError), database.write() as session:
            keys.revoke(session, key.split("_")[1], utc_now(), command_actor(name))
        database.close()
