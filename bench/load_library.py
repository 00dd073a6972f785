"""The library alone on the pairs that a service is loaded with: bare processes without database and HTTP."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.synchronize import Barrier
from queue import Queue

import commands  # noqa: F401 - sets the number of threads before NumPy is imported
from bench.load_pairs import Pair, read_rig, stage_request
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import Frame
from spinewatch.pipeline import StageMeasurer
from workers.memory import keep_freed_memory

_START_S = 120.0


class Library:
    """Measures pairs as a worker does, from the bytes of the files."""

    def __init__(self) -> None:
        keep_freed_memory()
        self._pool = ThreadPoolExecutor(max_workers=1)
        self._measurer = StageMeasurer(read_rig(), pool=self._pool)
        self._request = stage_request()

    def measure(self, pair: Pair) -> None:
        """Decode and measure a pair."""
        left, right = Frame(decode_image(pair.left), "left"), Frame(decode_image(pair.right), "right")
        self._measurer.measure(left, right, self._request)


def pairs_per_second(pairs: Sequence[Pair], processes: int) -> float:
    """Return how many pairs bare processes measure in a second together, after they have warmed up."""
    context = multiprocessing.get_context("spawn")
    barrier = context.Barrier(processes)
    spans: Queue[tuple[float, float]] = context.Queue()  # type: ignore[assignment]
    running = [
        context.Process(target=_measure_all, args=(pairs[k::processes], barrier, spans), daemon=True)
        for k in range(processes)
    ]
    for process in running:
        process.start()
    times = [spans.get(timeout=10 * _START_S) for _ in running]
    for process in running:
        process.join()
    return len(pairs) / (max(end for _, end in times) - min(start for start, _ in times))


def _measure_all(pairs: Sequence[Pair], barrier: Barrier, spans: Queue[tuple[float, float]]) -> None:
    library = Library()
    library.measure(pairs[0])
    barrier.wait(_START_S)
    start = time.monotonic()  # one clock for all processes of a machine
    for pair in pairs:
        library.measure(pair)
    spans.put((start, time.monotonic()))
