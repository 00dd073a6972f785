"""Values of settings that are texts: their forms, with messages that say the right one."""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Callable

from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError

from settings.patterns import LinearPattern

_HOST = re.compile(r"[A-Za-z0-9_](?:[A-Za-z0-9._-]*[A-Za-z0-9_])?", re.ASCII)
_ORIGIN = re.compile(r"(https?)://(?:[a-z0-9_][a-z0-9._-]*|\[[0-9a-f:.]+\])(?::([0-9]{1,5}))?", re.ASCII)
_DEFAULT_PORTS = {"http": "80", "https": "443"}
_EVERYWHERE = frozenset({"0.0.0.0", "::"})  # noqa: S104 - refused here
_LAST_PORT = 65535


def entries(text: str) -> list[str]:
    """Return the entries of a list that is separated by commas."""
    return [entry.strip() for entry in text.split(",") if entry.strip()]


def pattern(text: str) -> str:
    """Return a regular expression; raise ``ValueError`` if it is none, or needs look-around or back-references."""
    return LinearPattern(text).pattern


def host_names(text: str) -> str:
    """Return a list of names in the Host header; raise ``ValueError`` if one can never be there."""
    return _list_of(
        text, _is_host, "a name or address without scheme and port, such as spine.example or 192.0.2.7"
    )


def origins(text: str) -> str:
    """Return a list of origins of pages; raise ``ValueError`` if a browser can never send one."""
    return _list_of(
        text,
        _is_origin,
        "an origin as browsers send it: scheme and host in lower case, a port only if it is not the usual one, and no"
        " path, such as https://dashboard.example",
    )


def proxies(text: str) -> str:
    """Return a list of addresses and networks; raise ``ValueError`` if one is none, or trusts every address."""
    return _list_of(
        text,
        _is_proxy,
        "the address of a proxy or a network of them, such as 192.0.2.7 or 192.0.2.0/24; every address cannot be"
        " trusted",
    )


def database_url(text: str) -> str:
    """Return the URL of a database; raise ``ValueError`` if the record would be in memory."""
    return _stored(text, "a record", "spinewatch.sqlite")


def queue_url(text: str) -> str:
    """Return the URL of a queue; raise ``ValueError`` if the queue would be in memory."""
    return _stored(text, "a queue", "queue.sqlite")


def _stored(text: str, what: str, example: str) -> str:
    if _is_in_memory(text):
        raise ValueError(f"{what} in memory is not possible; name a file, such as sqlite:////data/{example}")
    return text


def _list_of(text: str, is_one: Callable[[str], bool], form: str) -> str:
    for entry in entries(text):
        if not is_one(entry):
            raise ValueError(f"{entry!r} is not {form}")
    return text


def _is_host(entry: str) -> bool:
    try:
        ipaddress.ip_address(entry)
    except ValueError:
        return _HOST.fullmatch(entry) is not None
    return entry not in _EVERYWHERE


def _is_origin(entry: str) -> bool:
    match = _ORIGIN.fullmatch(entry)
    if match is None:
        return False
    scheme, port = match.groups()
    return port is None or (port != _DEFAULT_PORTS[scheme] and 0 < int(port) <= _LAST_PORT)


def _is_proxy(entry: str) -> bool:
    try:
        return ipaddress.ip_network(entry).prefixlen > 0
    except ValueError:
        return False


def _is_in_memory(text: str) -> bool:
    try:
        url: URL = make_url(text)
        if url.get_backend_name() != "sqlite":
            return False
    except ArgumentError:
        return False  # who uses the URL says what is wrong with it
    except ValueError as error:
        raise ValueError(
            "the port of this URL is not a number; write it like postgresql://USER@HOST:5432/DB"
        ) from error
    name = url.database or ""
    return not name or ":memory:" in name or url.query.get("mode") == "memory" or "mode=memory" in name
