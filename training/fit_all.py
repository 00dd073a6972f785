"""Fitting of several networks at the same time, with progress."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, wait
from dataclasses import dataclass
from multiprocessing import get_context
from queue import Empty, Queue

from rich.progress import Progress

from spinewatch.detection.refinement.networks import BallNetwork
from spinewatch.simulation.images.examples import Examples
from training.errors import FitErrors
from training.fit import fit
from training.model import Architecture

_POLL_S = 0.5


@dataclass(frozen=True, eq=False)
class Fit:
    """What a network is fitted to.

    Attributes
    ----------
    architecture
        Architecture of the network.
    examples
        Examples on its grid.
    epochs
        Number of passes over them.
    left_out
        Families of looks whose examples are not trained on.
    """

    architecture: Architecture
    examples: Examples
    epochs: int
    left_out: tuple[str, ...] = ()


def fit_all(
    fits: Sequence[Fit], seed: int, processes: int, progress: Progress
) -> list[tuple[BallNetwork, FitErrors]]:
    """Return fitted networks with their errors on the held-out examples.

    Parameters
    ----------
    fits
        What the networks are fitted to, the longest first.
    seed
        Seed of each fit.
    processes
        Number of processes.
    progress
        Display of the number of epochs.

    Returns
    -------
    list of tuple
        Network and errors, in the order of the fits.
    """
    task = progress.add_task(f"epochs of {len(fits)} fits", total=sum(each.epochs for each in fits))
    context = get_context("spawn")
    with context.Manager() as manager, ProcessPoolExecutor(processes, mp_context=context) as pool:
        ended: Queue[int] = manager.Queue()
        futures = [pool.submit(_fit, each, seed, ended) for each in fits]
        pending = set(futures)
        while pending:
            pending = wait(pending, timeout=_POLL_S).not_done
            progress.advance(task, _drained(ended))
        return [future.result() for future in futures]


def _fit(task: Fit, seed: int, ended: Queue[int]) -> tuple[BallNetwork, FitErrors]:
    return fit(
        task.architecture, task.examples, task.epochs, seed, task.left_out, on_epoch=lambda: ended.put(1)
    )


def _drained(ended: Queue[int]) -> int:
    """Return the sum of the numbers in a queue, which is empty afterwards."""
    count = 0
    try:
        while True:
            count += ended.get_nowait()
    except Empty:
        return count
