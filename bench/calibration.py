"""``python -m bench.calibration``: calibration of rendered boards and of real data, beside peers.

``--check`` ends with status 1 when a bar is not reached. The boards and the real coordinates come with the project
(samples/calibration); ``--boards DIR`` takes other trials, named A, B, C ... with truth.json. docs/calibration.md
has the figures, and `python -m bench.thesis` the published tables.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from statistics import median
from time import perf_counter

import numpy as np

from bench.calibration_boards import angles, automatic, moved_board, processed_scenes
from bench.calibration_peers import against_dlt, compare
from bench.calibration_real import chessboards, openptv
from bench.tables import Bar, Grid, bars
from spinewatch.calibration.control_field import pegboard_1995
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.stereo import calibrate_stereo
from spinewatch.camera import Rig
from spinewatch.simulation.rigs import converging_rig

SAMPLES = Path(__file__).parents[1] / "samples"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m bench.calibration", description=__doc__)
    parser.add_argument("--boards", type=Path, default=SAMPLES / "calibration" / "C1")
    parser.add_argument("--scenes", type=Path, default=SAMPLES / "D1")
    parser.add_argument("--check", action="store_true", help="exit with 1 when a bar is not reached")
    parser.add_argument("--json", type=Path, help="write the bars here")
    options = parser.parse_args(arguments)
    real = SAMPLES / "calibration"
    checks: list[Bar] = []
    areas: list[Callable[[], list[Bar]]] = [
        lambda: automatic(options.boards),
        lambda: processed_scenes(options.boards, options.scenes),
        lambda: compare(options.boards),
        against_dlt,
        lambda: angles(options.boards),
        lambda: openptv(real / "openptv"),
        lambda: chessboards(real / "chessboards"),
        speed,
    ]
    for area in areas:
        checks += area()
    if options.json:
        options.json.write_text(json.dumps([asdict(bar) for bar in checks], indent=2) + "\n")
    bars(checks).print()
    return 0 if all(bar.holds for bar in checks) or not options.check else 1


def speed(runs: int = 5) -> list[Bar]:
    """Time a rig that sees all 30 pegs, from coordinates: one shot and five."""
    field = pegboard_1995()
    rig = converging_rig(500.0, 24.0, target_mm=(317.5, 254.0, 40.0))
    shots = simulated_shots(rig, 5)
    sensor = Sensor(rig.left.image_size_px, rig.left.pixel_size_mm)
    seconds: dict[int, list[float]] = {1: [], 5: []}
    for count, times in seconds.items():
        calibrate_stereo(shots[:count], (sensor, sensor))
        for _ in range(runs):
            start = perf_counter()
            calibrate_stereo(shots[:count], (sensor, sensor))
            times.append(perf_counter() - start)
    one, five = (median(seconds[k]) for k in (1, 5))
    rows = [(f"{k} shot(s)", f"{median(t):.3f}", f"{min(t):.3f} - {max(t):.3f}") for k, t in seconds.items()]
    Grid.of(f"Both cameras, {len(field)} points, {runs} runs", ["", "median s", "min - max s"], rows).print()
    return [
        Bar("one shot < 0.2 s", f"{one:.3f} s", one < 0.2),
        Bar("five shots < 2 s", f"{five:.3f} s", five < 2),
    ]


def simulated_shots(rig: Rig, count: int, sigma_px: float = 0.05) -> list[Shot]:
    """Return shots of the whole board, moved and tilted, with noise."""
    rng = np.random.default_rng(0)
    field = pegboard_1995()
    shots = []
    for s in range(count):
        place = moved_board(rng, field.points_mm.mean(axis=0)) if s else None
        X = field.points_mm if place is None else place(field.points_mm)
        left, right = (
            ImagePoints.build(
                field.ids, field.points_mm, c.project(X) + sigma_px * rng.standard_normal((30, 2))
            )
            for c in (rig.left, rig.right)
        )
        shots.append(Shot(str(s + 1), left, right))
    return shots


if __name__ == "__main__":
    sys.exit(main())
