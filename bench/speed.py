"""``python -m bench.speed``: time of one 568 x 416 pair beside OpenCV's own masked template matching.

The peer does a part of the work only: ten normalized correlations with a circular 19 x 19 template per image.
All run in turn on the same images in the same process, so that none gets the quieter half of the run. Freed memory is
kept for the next image, as in a worker.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median, quantiles
from time import perf_counter, process_time, thread_time
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from bench.tables import Bar, Grid, bars
from bench.truth import find_scenes, read_frames
from spinewatch.arrays import Pixels
from spinewatch.pipeline import StageMeasurer
from spinewatch.stage import StageRequest
from workers.memory import keep_freed_memory

SAMPLES = Path(__file__).parents[1] / "samples"
RUNS = 20
TEMPLATES = 10
SIDE = 19
MAX_ONE_THREAD_MS, MAX_TWO_THREADS_MS, MIN_TIMES_FASTER = 20.0, 13.0, 15.0
"""The bars. They are those of quiet cores: on a busy machine all but the ratio are missed."""


@dataclass(frozen=True)
class StepTime:
    """Milliseconds of a step: by the clock, on the CPU in the thread that measures, and on the CPU in the other one.

    The thread waits when it does not run: for the interpreter lock, for the other view, or for a core.
    """

    ms: float
    own_ms: float
    other_ms: float

    @property
    def waiting(self) -> float:
        """Fraction of the time in which the measuring thread does not run."""
        return max(0.0, 1 - self.own_ms / self.ms)


class StepClock:
    """A ``Progress`` callback that records the times of steps; a repeated step accumulates."""

    def __init__(self) -> None:
        self._times: dict[str, NDArray[np.float64]] = {}
        self._step = ""
        self._since = _clocks()

    def __call__(self, step: str, fraction: float = 0.0) -> None:
        """End the running step and start ``step``; ``fraction`` is not used."""
        now = _clocks()
        if self._step:
            self._times[self._step] = self._times.get(self._step, 0.0) + (now - self._since) * 1e3
        self._step, self._since = step, now

    def stop(self) -> dict[str, StepTime]:
        """End the running step; return the times of each step."""
        self("")
        return {
            step: StepTime(ms, own_ms, all_ms - own_ms) for step, (ms, own_ms, all_ms) in self._times.items()
        }


@dataclass(frozen=True, eq=False)
class Outcome:
    """Milliseconds of every run of each contender.

    Attributes
    ----------
    single
        One pair, with a measurer prepared for it alone, as ``spinewatch process`` does.
    prepared
        One pair, with a measurer prepared before, as a worker does.
    one_core
        The same, one view after the other.
    peer
        Ten masked correlations per image.
    steps, one_core_steps
        Steps of the prepared measurement by name, in two threads and in one.
    """

    single: Sequence[float]
    prepared: Sequence[float]
    one_core: Sequence[float]
    peer: Sequence[float]
    steps: Mapping[str, Sequence[StepTime]]
    one_core_steps: Mapping[str, Sequence[StepTime]]

    @property
    def ratio(self) -> float:
        """Time of the peer over that of one pair in one thread."""
        return median(self.peer) / median(self.one_core)

    @property
    def bars(self) -> tuple[Bar, ...]:
        """The bars and whether they are reached."""
        gain = median(single / prepared for single, prepared in zip(self.single, self.prepared, strict=True))
        one, two = median(self.one_core), median(self.prepared)
        return (
            Bar(
                f"one pair in one thread <= {MAX_ONE_THREAD_MS:.0f} ms",
                f"{one:.1f} ms",
                one <= MAX_ONE_THREAD_MS,
            ),
            Bar(
                f"one pair in one thread at least {MIN_TIMES_FASTER:.0f} times faster than the peer",
                f"{self.ratio:.1f} times",
                self.ratio >= MIN_TIMES_FASTER,
            ),
            Bar(
                f"one pair in two threads <= {MAX_TWO_THREADS_MS:.0f} ms",
                f"{two:.1f} ms",
                two <= MAX_TWO_THREADS_MS,
            ),
            Bar("a prepared measurer is faster", f"{gain:.2f} times", gain > 1),
        )

    @property
    def grids(self) -> tuple[Grid, ...]:
        """The tables."""
        columns = ["", "median ms", "10-90% ms", "times one pair", "faster than the peer"]
        one, peer = median(self.single), median(self.peer)
        contenders = {
            "Spinewatch, one pair": self.single,
            "Spinewatch, prepared measurer": self.prepared,
            "Spinewatch, prepared measurer, one thread": self.one_core,
            f"OpenCV, {TEMPLATES} masked matchTemplate per image": self.peer,
        }
        rows = [
            (name, *_spread(ms), f"{median(ms) / one:.2f}", f"{peer / median(ms):.1f}")
            for name, ms in contenders.items()
        ]
        return (
            Grid.of(f"One pair of 568 x 416, {len(self.peer)} runs", columns, rows),
            _step_grid("Steps of the prepared measurement", self.steps),
            _step_grid("The same in one thread", self.one_core_steps),
            bars(self.bars),
        )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m bench.speed", description=__doc__)
    parser.add_argument("--check", action="store_true", help="exit with 1 when a bar is missed")
    parser.add_argument("--json", type=Path, help="write the milliseconds here")
    parser.add_argument("--runs", type=int, default=RUNS)
    options = parser.parse_args(arguments)
    outcome = measure(options.runs)
    for grid in outcome.grids:
        grid.print()
    if options.json:
        options.json.write_text(json.dumps({**asdict(outcome), "ratio": outcome.ratio}, indent=2) + "\n")
    return 0 if all(bar.holds for bar in outcome.bars) or not options.check else 1


def measure(runs: int) -> Outcome:
    """Time the contenders in turn, ``runs`` times (2 or more) after one warm-up each."""
    keep_freed_memory()
    scene = next(scene for scene in find_scenes(SAMPLES) if scene.folder.name == "PRE")
    left, right = read_frames(scene.folder)
    request = StageRequest(labels=scene.labels, spine_axis=scene.spine_axis, triads=len(scene.labels))
    templates = cut_templates(left.pixels)

    def timed(measurer: StageMeasurer, steps: dict[str, list[StepTime]]) -> None:
        clock = StepClock()
        measurer.measure(left, right, request, clock)
        for step, time in clock.stop().items():
            steps.setdefault(step, []).append(time)

    steps: dict[str, list[StepTime]] = {}
    one_core_steps: dict[str, list[StepTime]] = {}
    with ThreadPoolExecutor(max_workers=1) as pool:
        measurer, in_one_thread = StageMeasurer(scene.rig, pool=pool), StageMeasurer(scene.rig)

        def single() -> None:
            with ThreadPoolExecutor(max_workers=1) as own:
                StageMeasurer(scene.rig, pool=own).measure(left, right, request)

        contenders = (
            single,
            lambda: timed(measurer, steps),
            lambda: timed(in_one_thread, one_core_steps),
            lambda: match_masked((left.pixels, right.pixels), templates),
        )
        for contender in contenders:
            contender()
        steps.clear()
        one_core_steps.clear()
        times = [[milliseconds(contender) for contender in contenders] for _ in range(runs)]
    single_ms, prepared_ms, one_core_ms, peer_ms = zip(*times, strict=True)
    return Outcome(single_ms, prepared_ms, one_core_ms, peer_ms, steps, one_core_steps)


def match_masked(images: Sequence[Pixels], templates: Sequence[Any]) -> None:
    """Correlate every image with every template under a circular mask, as OpenCV does it."""
    mask = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (SIDE, SIDE))
    for image in images:
        for template in templates:
            cv2.matchTemplate(image, template, cv2.TM_CCOEFF_NORMED, mask=mask)


def cut_templates(image: Pixels) -> list[Any]:
    """Return the templates: pieces of an image, since only their size matters here."""
    rows, columns = np.array(image.shape) - SIDE
    corners = [(rows * i // TEMPLATES, columns * i // TEMPLATES) for i in range(TEMPLATES)]
    return [np.ascontiguousarray(image[v : v + SIDE, u : u + SIDE]) for v, u in corners]


def milliseconds(run: Callable[[], object]) -> float:
    """Return how long a call takes."""
    start = perf_counter()
    run()
    return (perf_counter() - start) * 1e3


def _clocks() -> NDArray[np.float64]:
    """Return the clock, the CPU time of this thread and that of the process, s."""
    return np.array([perf_counter(), thread_time(), process_time()])


def _step_grid(title: str, steps: Mapping[str, Sequence[StepTime]]) -> Grid:
    """Return the table of the steps of a measurement."""
    columns = ["step", "median ms", "10-90% ms", "share", "CPU ms", "CPU ms, other thread", "waiting"]
    total = sum(median(time.ms for time in times) for times in steps.values())
    rows = [
        (
            name,
            *_spread([time.ms for time in times]),
            f"{median(time.ms for time in times) / total:.0%}",
            f"{median(time.own_ms for time in times):.1f}",
            f"{median(time.other_ms for time in times):.1f}",
            f"{median(time.waiting for time in times):.0%}",
        )
        for name, times in steps.items()
    ]
    return Grid.of(title, columns, rows)


def _spread(ms: Sequence[float]) -> tuple[str, str]:
    deciles = quantiles(ms, n=10)
    return f"{median(ms):.1f}", f"{deciles[0]:.1f} - {deciles[-1]:.1f}"


if __name__ == "__main__":
    sys.exit(main())
