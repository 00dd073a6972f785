"""The address that a server listens on."""

from __future__ import annotations

import socket

from spinewatch.errors import SpinewatchError


class PortTakenError(SpinewatchError):
    """The address of the service cannot be bound."""

    code = "port-taken"


def require_free_port(host: str, port: int) -> None:
    """Raise ``PortTakenError`` unless a server can listen on this address."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
            probe.listen()
        except OSError as error:
            raise PortTakenError(
                f"cannot listen on {host} port {port}: {error.strerror}; choose another with --port"
            ) from error
        except (UnicodeError, TypeError) as error:  # TypeError: of bytes that are no text
            raise PortTakenError(
                f"{host!r} is no address to listen on; choose another with --host"
            ) from error
