"""Failed attempts to be let in, counted per address, in bounded memory."""

from __future__ import annotations

import ipaddress
from collections import OrderedDict

MAX_FAILURES = 20
"""Failed attempts of one address within ``WINDOW_SECONDS``; further ones are told to wait."""
WINDOW_SECONDS = 60.0
MAX_ADDRESSES = 4096
_IPV6_NETWORK_BITS = 64


class FailedAttempts:
    """The failed attempts of recent addresses; the addresses that failed last are kept."""

    def __init__(self) -> None:
        self._failures: OrderedDict[str, tuple[float, int]] = OrderedDict()

    def wait_seconds(self, address: str, now: float) -> float:
        """Return how long an address has to wait; 0 when it may try."""
        started, count = self._failures.get(network_of(address), (now, 0))
        left = started + WINDOW_SECONDS - now
        return left if count >= MAX_FAILURES and left > 0 else 0.0

    def add(self, address: str, now: float) -> None:
        """Count a failed attempt; ``now`` is monotonic."""
        network = network_of(address)
        started, count = self._failures.pop(network, (now, 0))
        if now - started >= WINDOW_SECONDS:
            started, count = now, 0
        self._failures[network] = (started, count + 1)
        if len(self._failures) > MAX_ADDRESSES:
            self._failures.popitem(last=False)


def network_of(address: str) -> str:
    """Return an IPv4 address, or the network of an IPv6 address, of which a client may have any number."""
    try:
        parsed = ipaddress.ip_address(address)
    except ValueError:
        return address
    if parsed.version == 4:
        return address
    return str(ipaddress.ip_network((parsed, _IPV6_NETWORK_BITS), strict=False))
