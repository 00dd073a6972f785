"""Rounds of kill -9 of the service's processes while carts send stages: nothing lost, nothing twice, the same bits.

The rounds follow from the seed: how many kills, of what and when. Each cart sends the same pairs to a new surgery in
every round, so that its results must be those of a round without kills. A round waits most of the time, for leases to
expire and processes to start, so that several services, each with its database, are killed side by side.
"""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from bench import load_processes
from bench.load_cart import Cart, Document
from bench.load_pairs import Pair, make_pairs
from bench.load_processes import Role
from bench.load_record import Ledger, count
from bench.load_service import LoadService
from bench.tables import Bar, Grid

ROUNDS = 500
CARTS = 2
STAGES = 3
_MAX_KILLS = 3
_SPREAD_S = 0.7
_PROMISE_S = 15.0
_TARGETS = (Role.API, Role.WORKER, Role.SUPERVISOR, Role.CHILD, None)
"""What is killed; None stands for all processes at once."""


@dataclass(frozen=True)
class Kills:
    """What the rounds did to the service and to the stages.

    Attributes
    ----------
    rounds
        Number of rounds.
    killed
        Number of processes that were killed, by role.
    ledger
        What the database has of the stages of all rounds.
    failed
        Number of stages whose job did not succeed, by error.
    differing
        Number of results that are not those of the round without kills.
    seconds
        Time from the last kill of each round until the carts knew of the end of every job.
    statuses
        Number of answers by status.
    """

    rounds: int
    killed: Counter[str]
    ledger: Ledger
    failed: Counter[str]
    differing: int
    seconds: Sequence[float]
    statuses: Counter[int]

    @property
    def bars(self) -> tuple[Bar, ...]:
        """The bars and whether they are reached."""
        name = f"{self.rounds} rounds of kill -9"
        failed = sum(self.failed.values())
        slowest = max(self.seconds)
        whole = self.ledger.is_exactly_once and failed == self.differing == 0
        reached = f"{self.ledger.text}, {failed} failed, {self.differing} differing"
        return (
            Bar(f"{name}: none lost, doubled, failed, differing", reached, whole),
            Bar(
                f"every job ended within {_PROMISE_S:.0f} s of the last kill",
                f"{slowest:.1f} s",
                slowest <= _PROMISE_S,
            ),
        )

    @property
    def grids(self) -> tuple[Grid, ...]:
        """The table."""
        late = sum(seconds > _PROMISE_S for seconds in self.seconds)
        rows = [
            ("killed", ", ".join(f"{role}: {n}" for role, n in sorted(self.killed.items()))),
            ("stages", self.ledger.text),
            ("failed", ", ".join(f"{code}: {n}" for code, n in sorted(self.failed.items())) or "0"),
            ("differing results", str(self.differing)),
            (
                "from the last kill to the last end",
                f"median {np.median(self.seconds):.1f} s, largest {max(self.seconds):.1f} s, {late} rounds later",
            ),
            ("answers", ", ".join(f"{status}: {n}" for status, n in sorted(self.statuses.items()))),
        ]
        return (Grid.of(f"{self.rounds} rounds of kill -9", ["", ""], rows),)


@dataclass
class _Tally:
    """What the rounds of one service did."""

    surgeries: dict[str, int] = field(default_factory=dict)
    killed: Counter[str] = field(default_factory=Counter)
    failed: Counter[str] = field(default_factory=Counter)
    statuses: Counter[int] = field(default_factory=Counter)
    seconds: list[float] = field(default_factory=list)
    differing: int = 0


def run(services: Sequence[LoadService], rounds: int = ROUNDS, seed: int = 0) -> Kills:
    """Run a round without kills, and then rounds with kills; raises ``ServiceStuckError`` if a job never ends.

    The first service has the round without kills, and each of them an equal share of the others.
    """
    files = make_pairs(CARTS * STAGES, seed)
    assigned = [files[k::CARTS] for k in range(CARTS)]
    carts = _sent(services[0], assigned)
    expected = [_results(cart, files) for cart, files in zip(carts, assigned, strict=True)]
    for cart in carts:
        cart.close()

    ended_early = threading.Event()

    def share(place: int) -> tuple[_Tally, Ledger]:
        service, tally = services[place], _Tally()
        for number in range(place, rounds, len(services)):
            if ended_early.is_set():
                break
            _round(service, assigned, expected, np.random.default_rng([seed, number]), tally)
        service.wait_until_ready()
        return tally, count(service, tally.surgeries)

    with ThreadPoolExecutor(len(services)) as threads:
        try:
            tallies, ledgers = zip(*threads.map(share, range(len(services))), strict=True)
        except BaseException:
            ended_early.set()  # the pool waits for its threads
            raise
    return Kills(
        rounds,
        sum((tally.killed for tally in tallies), Counter()),
        Ledger.total(ledgers),
        sum((tally.failed for tally in tallies), Counter()),
        sum(tally.differing for tally in tallies),
        [seconds for tally in tallies for seconds in tally.seconds],
        sum((tally.statuses for tally in tallies), Counter()),
    )


def _round(
    service: LoadService,
    assigned: Sequence[Sequence[Pair]],
    expected: Sequence[Sequence[Document]],
    rng: np.random.Generator,
    tally: _Tally,
) -> None:
    stop, last_kill = threading.Event(), [time.monotonic()]
    killer = threading.Thread(target=_kill_some, args=(service, rng, tally.killed, last_kill))
    keeper = threading.Thread(target=_keep_running, args=(service, stop))
    killer.start()
    keeper.start()
    try:
        carts = _sent(service, assigned)
        ended = time.monotonic()
        killer.join()
        if last_kill[0] < ended:
            tally.seconds.append(ended - last_kill[0])
        for cart, files, results in zip(carts, assigned, expected, strict=True):
            tally.surgeries[cart.surgery] = len(files)
            found = _results(cart, files, tally.failed)
            tally.differing += sum(one != other for one, other in zip(found, results, strict=True) if one)
            tally.statuses.update(cart.statuses)
            cart.close()
    finally:
        stop.set()
        killer.join()
        keeper.join()


def _sent(service: LoadService, assigned: Sequence[Sequence[Pair]]) -> list[Cart]:
    """Let carts send their pairs at the same time, and wait until all jobs have ended."""
    carts = [Cart.of(service, insistent=True) for _ in assigned]
    with ThreadPoolExecutor(len(carts)) as threads:
        list(threads.map(_send, carts, assigned))
    return carts


def _send(cart: Cart, files: Sequence[Pair]) -> None:
    cart.open_surgery()
    for job in [cart.submit(f"S{number}", pair) for number, pair in enumerate(files)]:
        cart.ended(job)


def _results(cart: Cart, files: Sequence[Pair], failed: Counter[str] | None = None) -> list[Document]:
    """Return the results of a cart's stages, an empty one where the job did not succeed."""
    results = []
    for number in range(len(files)):
        stage = cart.request("GET", f"/v1/surgeries/{cart.surgery}/stages/S{number}").json()
        if stage["state"] == "succeeded":
            results.append(cart.result(f"S{number}"))
            continue
        error = stage["job"]["error"] or {"type": stage["state"]}
        if failed is not None:
            failed[str(error["type"]).rpartition(":")[2]] += 1
        results.append({})
    return results


def _kill_some(
    service: LoadService, rng: np.random.Generator, killed: Counter[str], last_kill: list[float]
) -> None:
    for _ in range(rng.integers(1, _MAX_KILLS + 1)):
        time.sleep(rng.uniform(0.0, _SPREAD_S))
        target = _TARGETS[rng.integers(len(_TARGETS))]
        processes = [p for p in service.processes() if target is None or p.role is target]
        if target is Role.CHILD and not processes:
            processes = [p for p in service.processes() if p.role is Role.WORKER]
        if not processes:
            continue
        if target is not None:
            processes = [processes[rng.integers(len(processes))]]
        load_processes.kill(process.pid for process in processes)
        last_kill[0] = time.monotonic()
        killed.update(str(process.role) for process in processes)


def _keep_running(service: LoadService, stop: threading.Event) -> None:
    while not stop.wait(0.1):
        service.keep_running()
