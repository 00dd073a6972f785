"""One cart: the time from the upload of a pair to its result, beside the library's time for the same pair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from statistics import median, quantiles

from bench.load_cart import Cart, milliseconds
from bench.load_library import Library
from bench.load_pairs import Pair, make_pairs
from bench.load_service import LoadService
from bench.tables import Bar, Grid

PAIRS = 60
_WARM_UP = 5
_FACTOR, _ADDED_MS = 2.0, 30.0


@dataclass(frozen=True)
class Latency:
    """Milliseconds of every pair.

    Attributes
    ----------
    service
        From the start of the upload until the triads are there.
    library
        From the bytes of the files to the result in one process, measured in turn with the uploads.
    long_poll
        Whether the cart waited in the request.
    """

    service: Sequence[float]
    library: Sequence[float]
    long_poll: bool

    @property
    def limit_ms(self) -> float:
        """Largest median that keeps the promise."""
        return _FACTOR * median(self.library) + _ADDED_MS

    @property
    def bars(self) -> tuple[Bar, ...]:
        """The bar and whether it is reached."""
        promise = f"one cart: upload to result, median <= {_FACTOR:.0f} x library + {_ADDED_MS:.0f} ms"
        reached = f"{median(self.service):.0f} ms of {self.limit_ms:.0f} ms"
        return (Bar(promise, reached, median(self.service) <= self.limit_ms),)

    @property
    def grids(self) -> tuple[Grid, ...]:
        """The table."""
        how = "waits in the request" if self.long_poll else "asks every 20 ms"
        rows = [(f"upload to result, cart {how}", *_row(self.service)), ("library", *_row(self.library))]
        title = f"One cart, {len(self.service)} pairs"
        return (Grid.of(title, ["", "median ms", "p90 ms", "largest ms"], rows),)


def measure(service: LoadService, pairs: int = PAIRS, seed: int = 0) -> Latency:
    """Send pairs one after another; after each one the library measures it alone."""
    files = make_pairs(pairs + _WARM_UP, seed)
    library = Library()
    cart = Cart.of(service)
    cart.open_surgery()
    times = []
    for number, pair in enumerate(files):
        name = f"S{number}"
        there = milliseconds(partial(_send_and_get, cart, name, pair))
        times.append((there, milliseconds(partial(library.measure, pair))))
    cart.close()
    sent, alone = zip(*times[_WARM_UP:], strict=True)
    return Latency(sent, alone, cart.long_poll)


def _send_and_get(cart: Cart, name: str, pair: Pair) -> None:
    cart.ended(cart.submit(name, pair))
    cart.result(name)


def _row(ms: Sequence[float]) -> tuple[str, str, str]:
    return f"{median(ms):.0f}", f"{quantiles(ms, n=10)[-1]:.0f}", f"{max(ms):.0f}"
