"""Hours under load: the memory of every process must not grow."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from bench.load_cart import Cart
from bench.load_pairs import Pair, make_pairs
from bench.load_processes import Role
from bench.load_service import LoadService
from bench.tables import Bar, Grid

_CARTS = 2
_PAIRS = 30
_SAMPLES = 120
_SETTLED = 0.25
"""Fraction of the time after which memory counts: caches are filled by then."""
_LARGEST_GROWTH = 0.10
_MIB = 1024 * 1024


@dataclass(frozen=True)
class Soak:
    """Memory over time.

    Attributes
    ----------
    seconds
        Duration.
    stages
        Number of stages that were measured.
    times_s
        When memory was read.
    memory
        Memory of all processes of each role at those times, bytes.
    """

    seconds: float
    stages: int
    times_s: Sequence[float]
    memory: Mapping[Role, Sequence[int]]

    @property
    def growth(self) -> Mapping[Role, float]:
        """Growth of each role's memory from a quarter of the time to the end by a straight line, over its mean."""
        times = np.asarray(self.times_s)
        settled = times >= _SETTLED * self.seconds
        found = {}
        for role, values in self.memory.items():
            held = np.asarray(values, float)[settled]
            slope = np.polyfit(times[settled], held, 1)[0]
            found[role] = float(slope * self.seconds * (1 - _SETTLED) / max(held.mean(), 1.0))
        return found

    @property
    def bars(self) -> tuple[Bar, ...]:
        """The bar and whether it is reached."""
        worst = max(self.growth.values())
        promise = f"{self.seconds / 3600:.2g} h under load: memory grows by < {_LARGEST_GROWTH:.0%}"
        return (Bar(promise, f"{worst:+.1%}", worst < _LARGEST_GROWTH),)

    @property
    def grids(self) -> tuple[Grid, ...]:
        """The table."""
        rows = [
            (
                role,
                f"{np.median(values) / _MIB:.0f}",
                f"{max(values) / _MIB:.0f}",
                f"{self.growth[role]:+.1%}",
            )
            for role, values in self.memory.items()
        ]
        title = f"{self.seconds / 60:.0f} minutes under load, {self.stages} stages"
        return (Grid.of(title, ["processes", "median MiB", "largest MiB", "growth"], rows),)


def measure(service: LoadService, hours: float, seed: int = 4) -> Soak:
    """Let carts send pairs one after another for some hours, each a new surgery after every few pairs."""
    seconds = 3600 * hours
    files = make_pairs(_PAIRS, seed)
    start = time.monotonic()
    times, memory = [], []
    with ThreadPoolExecutor(_CARTS) as threads:
        running = [threads.submit(_send_until, service, files, start + seconds) for _ in range(_CARTS)]
        while not all(one.done() for one in running):
            times.append(time.monotonic() - start)
            memory.append(_memory(service))
            time.sleep(seconds / _SAMPLES)
        stages = sum(one.result() for one in running)
    return Soak(seconds, stages, times, {role: [found[role] for found in memory] for role in Role})


def _send_until(service: LoadService, files: Sequence[Pair], end: float) -> int:
    cart = Cart.of(service)
    sent = 0
    while time.monotonic() < end:
        cart.open_surgery()
        for number, pair in enumerate(files):
            if time.monotonic() > end:
                break
            cart.ended(cart.submit(f"S{number}", pair))
            sent += 1
    cart.close()
    return sent


def _memory(service: LoadService) -> Mapping[Role, int]:
    total = dict.fromkeys(Role, 0)
    for process in service.processes():
        total[process.role] += process.rss_bytes
    return total
