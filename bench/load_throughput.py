"""Throughput: two workers beside two bare processes on the same pairs, and the processor time of the API.

The rate of the workers is taken twice: on a backlog that is put into the database at once, so that API and carts leave
both cores to the workers, and while carts send. The bar is for the backlog: on two cores, carts, API and workers share
what bare processes have for themselves.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from datetime import datetime
from statistics import median

from sqlalchemy import select

from bench import load_library
from bench.load_cart import Cart
from bench.load_pairs import Pair, make_pairs
from bench.load_processes import Role, cpu_by_role
from bench.load_service import LoadService
from bench.tables import Bar, Grid
from contract.event import Actor, ActorKind
from spinewatch.imaging.header import inspect_image
from store import calibrations, stage_submission, surgeries
from store.clock import utc_now
from store.images import NewImage
from store.stage_submission import NewStage
from store.tables.jobs import STAGE_JOB, Job

PAIRS = 120
ROUNDS = 3
WORKERS = 2
_CARTS = 4
_SHARE = 0.85
_API_MS = 25.0


@dataclass(frozen=True)
class Throughput:
    """Rates and processor time.

    Attributes
    ----------
    bare
        Pairs per second of bare processes, in each round.
    backlog
        Stages per second of the workers from the first start to the last end, every pair there before.
    sending
        Stages per second from the first upload to the last result, while carts send.
    api_ms, workers_ms
        Processor time per stage of the API and of workers with their children while carts send, ms.
    """

    bare: Sequence[float]
    backlog: Sequence[float]
    sending: Sequence[float]
    api_ms: float
    workers_ms: float

    @property
    def share(self) -> float:
        """Rate of the workers over that of bare processes, median over the rounds."""
        return median(one / other for one, other in zip(self.backlog, self.bare, strict=True))

    @property
    def bars(self) -> tuple[Bar, ...]:
        """The bars and whether they are reached."""
        return (
            Bar(
                f"two workers >= {_SHARE:.0%} of two bare processes",
                f"{self.share:.0%}",
                self.share >= _SHARE,
            ),
            Bar(
                f"processor time of the API <= {_API_MS:.0f} ms a stage",
                f"{self.api_ms:.0f} ms",
                self._api_holds,
            ),
        )

    @property
    def grids(self) -> tuple[Grid, ...]:
        """The table."""
        rows = [
            ("two bare processes", f"{median(self.bare):.1f}", "", ""),
            ("two workers, backlog", f"{median(self.backlog):.1f}", "", f"{self.share:.0%}"),
            (
                "two workers, while carts send",
                f"{median(self.sending):.1f}",
                f"API {self.api_ms:.0f}, workers {self.workers_ms:.0f}",
                f"{median(s / b for s, b in zip(self.sending, self.bare, strict=True)):.0%}",
            ),
        ]
        return (Grid.of("Throughput", ["", "pairs/s", "processor time, ms a stage", "of bare"], rows),)

    @property
    def _api_holds(self) -> bool:
        return self.api_ms <= _API_MS


def measure(service: LoadService, pairs: int = PAIRS, rounds: int = ROUNDS, seed: int = 1) -> Throughput:
    """Measure the rates in turn, so that none gets the quieter part of the run."""
    bare, backlog, sending, api, workers = [], [], [], [], []
    for number in range(rounds):
        files = make_pairs(pairs, seed + number)
        bare.append(load_library.pairs_per_second(files, WORKERS))
        backlog.append(_backlog(service, files))
        rate, cpu = _sending(service, files)
        sending.append(rate)
        api.append(cpu[Role.API])
        workers.append(cpu[Role.WORKER] + cpu[Role.CHILD])
    return Throughput(bare, backlog, sending, median(api), median(workers))


def _backlog(service: LoadService, files: Sequence[Pair]) -> float:
    """Return the rate of the workers on pairs that wait in the queue when they begin."""
    carts = _open_carts(service)
    jobs = enqueue_all(service, _assigned(carts, files))
    for job in jobs:
        carts[0].ended(job)
    for cart in carts:
        cart.close()
    first, last = _span(service, jobs)
    return len(files) / (last - first).total_seconds()


def enqueue_all(service: LoadService, work: Sequence[tuple[Cart, Sequence[Pair]]]) -> list[str]:
    """Store the pairs of carts as stages in one transaction, and enqueue their jobs; return the jobs."""
    database, queue, jobs = service.database(), service.queue(), []
    actor = Actor(kind=ActorKind.COMMAND, name="bench.load")
    with database.write() as session:
        for cart, files in work:
            surgery = surgeries.get(session, cart.surgery)
            calibration = calibrations.get(session, cart.calibration)
            for number, pair in enumerate(files):
                left, right = (NewImage(data, inspect_image(data)) for data in (pair.left, pair.right))
                new = NewStage(f"S{number}", left, right, None)
                jobs.append(
                    stage_submission.submit(session, surgery, calibration, new, utc_now(), actor).job.id
                )
    for job in jobs:
        queue.enqueue(job)
    queue.close()
    database.close()
    return jobs


def _sending(service: LoadService, files: Sequence[Pair]) -> tuple[float, dict[Role, float]]:
    """Return the rate while carts send, and the processor time per stage by role, ms."""
    carts = _open_carts(service)
    before = cpu_by_role(service.processes())
    start = time.monotonic()
    with ThreadPoolExecutor(_CARTS) as threads:
        list(threads.map(_send_and_wait, _assigned(carts, files)))
    rate = len(files) / (time.monotonic() - start)
    after = cpu_by_role(service.processes())
    for cart in carts:
        cart.close()
    return rate, {role: (after[role] - before[role]) * 1e3 / len(files) for role in Role}


def _open_carts(service: LoadService) -> list[Cart]:
    carts = [Cart.of(service) for _ in range(_CARTS)]
    for cart in carts:
        cart.open_surgery()
    return carts


def _assigned(carts: Sequence[Cart], files: Sequence[Pair]) -> list[tuple[Cart, Sequence[Pair]]]:
    return [(cart, files[k :: len(carts)]) for k, cart in enumerate(carts)]


def _send_and_wait(work: tuple[Cart, Sequence[Pair]]) -> None:
    cart, files = work
    for number, pair in enumerate(files):
        cart.ended(cart.submit(f"S{number}", pair))


def _span(service: LoadService, jobs: Sequence[str]) -> tuple[datetime, datetime]:
    """Return when the first of some stage jobs started and when the last one ended."""
    database = service.database()
    with database.read() as session:
        query = select(Job.started_at, Job.finished_at).where(Job.kind == STAGE_JOB, Job.id.in_(jobs))
        rows = [
            (start, end) for start, end in session.execute(query) if start is not None and end is not None
        ]
    database.close()
    return min(start for start, _ in rows), max(end for _, end in rows)
