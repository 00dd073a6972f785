"""``python -m bench.speed``: time of one 568 x 416 pair beside OpenCV's own masked template matching.

The peer does a part of the work only: ten normalised correlations with a circular 19 x 19 template per image.
Both run in turn on the same pictures in the same process, so that neither gets the quieter half of the run.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median, quantiles
from time import perf_counter
from typing import Any

import cv2
import numpy as np

from bench.tables import Bar, Grid, bars
from bench.truth import find_scenes
from commands.shared.stopwatch import Stopwatch
from spinewatch.arrays import Pixels
from spinewatch.imaging.decoding import decode_image
from spinewatch.pipeline import StageRequest, measure_stage

SAMPLES = Path(__file__).parents[1] / "samples"
RUNS = 20
TEMPLATES = 10
SIDE = 19
BAR = 5.0


@dataclass(frozen=True, eq=False)
class Outcome:
    """Milliseconds of every run: the pipeline's, the peer's, and those of the pipeline's steps by name."""

    pipeline: Sequence[float]
    peer: Sequence[float]
    steps: Mapping[str, Sequence[float]]

    @property
    def ratio(self) -> float:
        """How many times faster the pipeline is than the peer."""
        return median(self.peer) / median(self.pipeline)

    @property
    def bars(self) -> tuple[Bar, ...]:
        """What was promised."""
        return (Bar(f"at least {BAR:.0f} times faster", f"{self.ratio:.1f} times", self.ratio >= BAR),)

    @property
    def grids(self) -> tuple[Grid, ...]:
        """The tables."""
        columns = ["", "median ms", "10-90% ms", "times the pipeline"]
        rows = [
            ("Spinewatch, the whole pipeline", *_spread(self.pipeline), "1.0"),
            (f"OpenCV, {TEMPLATES} masked matchTemplate an image", *_spread(self.peer), f"{self.ratio:.1f}"),
        ]
        steps = [(name, *_spread(ms)) for name, ms in self.steps.items()]
        return (
            Grid.of(f"One pair of 568 x 416, {len(self.peer)} runs", columns, rows),
            Grid.of("Steps of the pipeline", ["step", "median ms", "10-90% ms"], steps),
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
        times = {"pipeline": outcome.pipeline, "peer": outcome.peer, "steps": outcome.steps}
        options.json.write_text(json.dumps({**times, "ratio": outcome.ratio}, indent=2) + "\n")
    return 0 if all(bar.holds for bar in outcome.bars) or not options.check else 1


def measure(runs: int) -> Outcome:
    """Time both contenders in turn, ``runs`` times (2 or more) after one warm-up each."""
    scene = next(scene for scene in find_scenes(SAMPLES) if scene.folder.name == "PRE")
    left, right = (decode_image((scene.folder / f"{side}.png").read_bytes()) for side in ("left", "right"))
    request = StageRequest(labels=scene.labels, spine_axis=scene.spine_axis, triads=len(scene.labels))
    templates = cut_templates(left)
    steps: dict[str, list[float]] = {}

    def pipeline() -> None:
        clock = Stopwatch()
        measure_stage(left, right, scene.rig, request, progress=clock)
        for step, ms in clock.stop().items():
            steps.setdefault(step, []).append(ms)

    def peer() -> None:
        match_masked((left, right), templates)

    pipeline()
    peer()
    steps.clear()
    times = [(milliseconds(pipeline), milliseconds(peer)) for _ in range(runs)]
    ours, theirs = zip(*times, strict=True)
    return Outcome(ours, theirs, steps)


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
