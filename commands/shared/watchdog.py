"""A sign of life from each process to whoever supervises it, by the protocol of systemd.

A process sends ``WATCHDOG=1`` to the socket in ``NOTIFY_SOCKET`` from its main loop. `spinewatch run` ends a process
that is silent for too long, and so does systemd for a unit with ``WatchdogSec=`` (sd_notify(3)).
"""

from __future__ import annotations

import os
import socket
import sys
from contextlib import suppress

_VARIABLE = "NOTIFY_SOCKET"
_BEAT = b"WATCHDOG=1"
_MAX_BYTES = 4096
_LONGEST_ROUND_SECONDS = 1.0


class Notifier:
    """Gives a sign of life each time it is called; it never waits and never fails."""

    def __init__(self, address: str) -> None:
        self._address = f"\0{address[1:]}" if address.startswith("@") else address
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
        self._socket.setblocking(False)

    def __call__(self) -> None:
        """Give a sign of life."""
        with suppress(OSError):  # a full socket has signs enough; a closed one has nobody to read them
            self._socket.sendto(_BEAT, self._address)

    def close(self) -> None:
        """Give no more signs."""
        self._socket.close()


def notifier() -> Notifier | None:
    """Return what gives a sign of life to the supervisor, None if there is none."""
    address = os.environ.get(_VARIABLE)
    return Notifier(address) if address else None


class Watchdog:
    """The signs of life of one process; silence counts from the first one on."""

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._silent_for: float | None = None
        self._last_round: float | None = None
        self._socket: socket.socket | None = None
        if sys.platform == "linux":
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
            self._socket.bind("")  # Linux chooses a free abstract name
            self._socket.setblocking(False)

    @property
    def environment(self) -> dict[str, str]:
        """Variables for the process."""
        if self._socket is None:
            return {}
        return {_VARIABLE: f"@{self._socket.getsockname()[1:].decode('ascii')}"}

    def is_silent(self, now: float) -> bool:
        """Return whether the process has been silent for too long at a time of the monotonic clock, s.

        Time in which the supervisor itself did not run does not count.
        """
        elapsed = 0.0 if self._last_round is None else min(now - self._last_round, _LONGEST_ROUND_SECONDS)
        self._last_round = now
        if self._heard():
            self._silent_for = 0.0
        elif self._silent_for is not None:
            self._silent_for += elapsed
        return self._silent_for is not None and self._silent_for > self._seconds

    def close(self) -> None:
        """Stop listening."""
        if self._socket is not None:
            self._socket.close()

    def _heard(self) -> bool:
        heard = False
        with suppress(BlockingIOError):
            while self._socket is not None:
                heard |= self._socket.recv(_MAX_BYTES).startswith(_BEAT)
        return heard
