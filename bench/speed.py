"""``python -m bench.speed``: time of one 568 x 416 pair beside OpenCV's own masked template matching.

The peer does a part of the work only: ten normalized correlations with a circular 19 x 19 template per image.
Both run in turn on the same images in the same process, so that neither gets the quieter half of the run.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from statistics import median, quantiles
from time import perf_counter
from typing import Any

import cv2
import numpy as np

from bench.tables import Bar, Grid, bars
from bench.truth import find_scenes, read_frames
from commands.shared.stopwatch import Stopwatch
from spinewatch.arrays import Pixels
from spinewatch.pipeline import StageMeasurer, StageRequest

SAMPLES = Path(__file__).parents[1] / "samples"
RUNS = 20
TEMPLATES = 10
SIDE = 19
BAR = 5.0


@dataclass(frozen=True, eq=False)
class Outcome:
    """Milliseconds of every run of each contender.

    Attributes
    ----------
    single
        One pair, with a measurer prepared for it alone, as ``spinewatch process`` does.
    prepared
        One pair, with a measurer prepared before, as a worker does.
    peer
        Ten masked correlations per image.
    steps
        Steps of the prepared measurement by name.
    """

    single: Sequence[float]
    prepared: Sequence[float]
    peer: Sequence[float]
    steps: Mapping[str, Sequence[float]]

    @property
    def ratio(self) -> float:
        """Time of the peer over that of one pair."""
        return median(self.peer) / median(self.single)

    @property
    def bars(self) -> tuple[Bar, ...]:
        """The bars and whether they are reached."""
        gain = median(single / prepared for single, prepared in zip(self.single, self.prepared, strict=True))
        return (
            Bar(
                f"one pair at least {BAR:.0f} times faster than the peer",
                f"{self.ratio:.1f} times",
                self.ratio >= BAR,
            ),
            Bar("a prepared measurer is faster", f"{gain:.2f} times", gain > 1),
        )

    @property
    def grids(self) -> tuple[Grid, ...]:
        """The tables."""
        columns = ["", "median ms", "10-90% ms", "times one pair"]
        one = median(self.single)
        rows = [
            ("Spinewatch, one pair", *_spread(self.single), "1.0"),
            ("Spinewatch, prepared measurer", *_spread(self.prepared), f"{median(self.prepared) / one:.2f}"),
            (f"OpenCV, {TEMPLATES} masked matchTemplate per image", *_spread(self.peer), f"{self.ratio:.1f}"),
        ]
        steps = [(name, *_spread(ms)) for name, ms in self.steps.items()]
        return (
            Grid.of(f"One pair of 568 x 416, {len(self.peer)} runs", columns, rows),
            Grid.of("Steps of the prepared measurement", ["step", "median ms", "10-90% ms"], steps),
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
        times = {
            "single": outcome.single,
            "prepared": outcome.prepared,
            "peer": outcome.peer,
            "steps": outcome.steps,
        }
        options.json.write_text(json.dumps({**times, "ratio": outcome.ratio}, indent=2) + "\n")
    return 0 if all(bar.holds for bar in outcome.bars) or not options.check else 1


def measure(runs: int) -> Outcome:
    """Time the contenders in turn, ``runs`` times (2 or more) after one warm-up each."""
    scene = next(scene for scene in find_scenes(SAMPLES) if scene.folder.name == "PRE")
    left, right = read_frames(scene.folder)
    request = StageRequest(labels=scene.labels, spine_axis=scene.spine_axis, triads=len(scene.labels))
    templates = cut_templates(left.pixels)
    steps: dict[str, list[float]] = {}
    with ThreadPoolExecutor(max_workers=1) as pool:
        measurer = StageMeasurer(scene.rig, pool=pool)

        def single() -> None:
            with ThreadPoolExecutor(max_workers=1) as own:
                StageMeasurer(scene.rig, pool=own).measure(left, right, request)

        def prepared() -> None:
            clock = Stopwatch()
            measurer.measure(left, right, request, clock)
            for step, ms in clock.stop().items():
                steps.setdefault(step, []).append(ms)

        def peer() -> None:
            match_masked((left.pixels, right.pixels), templates)

        contenders = (single, prepared, peer)
        for contender in contenders:
            contender()
        steps.clear()
        times = [[milliseconds(contender) for contender in contenders] for _ in range(runs)]
    single_ms, prepared_ms, peer_ms = zip(*times, strict=True)
    return Outcome(single_ms, prepared_ms, peer_ms, steps)


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


def _spread(ms: Sequence[float]) -> tuple[str, str]:
    deciles = quantiles(ms, n=10)
    return f"{median(ms):.1f}", f"{deciles[0]:.1f} - {deciles[-1]:.1f}"


if __name__ == "__main__":
    sys.exit(main())
