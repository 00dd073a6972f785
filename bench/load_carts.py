"""Many carts at once: every stage exactly once, and no answer that blames the service."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from bench.load_cart import Cart
from bench.load_pairs import Pair, make_pairs
from bench.load_record import Ledger, count
from bench.load_service import LoadService
from bench.tables import Bar, Grid

CARTS = 16
PAIRS = 50


@dataclass(frozen=True)
class ManyCarts:
    """What many carts sent and got.

    Attributes
    ----------
    carts, pairs
        Number of carts, and of pairs that each of them sent.
    statuses
        Number of answers by status.
    states
        Number of jobs by state at their end.
    ledger
        What the database has of the stages.
    """

    carts: int
    pairs: int
    statuses: Counter[int]
    states: Counter[str]
    ledger: Ledger

    @property
    def server_errors(self) -> int:
        """Number of answers with a status of 500 or more."""
        return sum(n for status, n in self.statuses.items() if status >= 500)

    @property
    def bars(self) -> tuple[Bar, ...]:
        """The bars and whether they are reached."""
        name = f"{self.carts} carts x {self.pairs} pairs"
        once = self.ledger.is_exactly_once and self.states["succeeded"] == self.carts * self.pairs
        return (
            Bar(f"{name}: every stage exactly once", self.ledger.text, once),
            Bar(f"{name}: no answer of 500 or more", f"{self.server_errors}", self.server_errors == 0),
        )

    @property
    def grids(self) -> tuple[Grid, ...]:
        """The table."""
        rows = [
            ("answers", _text(self.statuses)),
            ("jobs", _text(self.states)),
            ("database", self.ledger.text),
        ]
        return (Grid.of(f"{self.carts} carts x {self.pairs} pairs", ["", "count"], rows),)


def measure(service: LoadService, carts: int = CARTS, pairs: int = PAIRS, seed: int = 2) -> ManyCarts:
    """Let every cart send its pairs without waiting for results, and then wait for all of them."""
    files = make_pairs(carts * pairs, seed)
    clients = [Cart.of(service) for _ in range(carts)]
    with ThreadPoolExecutor(carts) as threads:
        states = list(threads.map(_send_all, clients, [files[k::carts] for k in range(carts)]))
    statuses: Counter[int] = Counter()
    for cart in clients:
        statuses.update(cart.statuses)
        cart.close()
    expected = {cart.surgery: pairs for cart in clients}
    return ManyCarts(
        carts, pairs, statuses, Counter(s for sent in states for s in sent), count(service, expected)
    )


def _send_all(cart: Cart, files: Sequence[Pair]) -> list[str]:
    cart.open_surgery()
    jobs = [cart.submit(f"S{number}", pair) for number, pair in enumerate(files)]
    return [cart.ended(job)["state"] for job in jobs]


def _text(counts: Counter[int] | Counter[str]) -> str:
    return ", ".join(f"{key}: {n}" for key, n in sorted(counts.items(), key=str))
