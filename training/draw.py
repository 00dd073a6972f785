"""Drawing of examples by several processes."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import cv2
import numpy as np
from rich.progress import Progress

from spinewatch.simulation.images.examples import Examples, random_examples
from spinewatch.simulation.images.shots import ExampleParameters

_CHUNK = 2000
"""Examples per chunk; part of what a seed means."""


def draw(
    parameters: ExampleParameters, count: int, seed: int, processes: int, progress: Progress
) -> Examples:
    """Return random examples; the number of processes does not change them, because each chunk has its own seed.

    Parameters
    ----------
    parameters
        Properties of the examples.
    count
        Number of examples.
    seed
        Seed of the random numbers.
    processes
        Number of processes.
    progress
        Display of the number of examples drawn.

    Returns
    -------
    examples : Examples
        The examples.
    """
    sizes = [min(_CHUNK, count - start) for start in range(0, count, _CHUNK)]
    grid = parameters.grid.size
    hard = parameters.hard_for is not None
    seeds = np.random.SeedSequence([seed, grid, len(parameters.left_out), int(hard)]).spawn(len(sizes))
    looks = "usual looks" if parameters.left_out else "all looks"
    looks += ", hard negatives" if hard else ""
    task = progress.add_task(f"examples of {grid} x {grid}, {looks}", total=count)
    parts = []
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        for part in pool.map(_draw_chunk, seeds, sizes, [parameters] * len(sizes)):
            parts.append(part)
            progress.advance(task, len(part.ball))
    return Examples.concatenate(parts)


def _draw_chunk(seed: np.random.SeedSequence, count: int, parameters: ExampleParameters) -> Examples:
    cv2.setNumThreads(1)
    return random_examples(np.random.default_rng(seed), count, parameters)
