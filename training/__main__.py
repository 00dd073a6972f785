"""``python -m training --out FILE``: draw simulated pictures, train the ball networks, write their weights.

With the numbers that are set it takes under an hour on two cores and gives the network that ships with the library, but
for the rounding of sums that run in another order on another machine. Needs PyTorch (docs/detection.md).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from spinewatch.detection.refinement.networks import BallNet, BallNets, write_ball_nets
from spinewatch.detection.refinement.patches import PatchGrid
from spinewatch.simulation.images.examples import ExampleParameters
from training.draw import draw
from training.fit import Architecture, fit

SCOUT = Architecture(PatchGrid(25, 5.0), 0.0, ((5, 3, 8), (3, 1, 16), (3, 2, 24)), 32)
SMALL = (
    Architecture(PatchGrid(25, 5.0), 0.0, ((5, 2, 16), (3, 1, 32), (3, 2, 48)), 64),
    ExampleParameters(PatchGrid(25, 5.0), (7.0, 13.5), wider=32.0),
)
LARGE = (
    Architecture(PatchGrid(49, 10.0), 15.0, ((5, 2, 16), (3, 2, 24), (3, 1, 32), (3, 2, 48)), 64),
    ExampleParameters(PatchGrid(49, 10.0), (14.0, 36.0), wider=36.0),
)
"""The scout; the judge for balls of usual size, whose examples the scout learns from too; the judge for large pictures,
which keeps their detail."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Train the networks; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m training", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="file of the weights")
    parser.add_argument(
        "--examples", type=int, nargs=2, default=(144_000, 36_000), metavar=("SMALL", "LARGE")
    )
    parser.add_argument(
        "--epochs", type=int, nargs=3, default=(16, 40, 60), metavar=("SCOUT", "SMALL", "LARGE")
    )
    parser.add_argument("--seed", type=int, default=1995)
    parser.add_argument("--processes", type=int, default=2, help="that draw examples")
    options = parser.parse_args(arguments)
    console = Console(stderr=True)
    scouting, small, large = options.epochs
    small_balls, large_balls = options.examples
    nets: list[BallNet] = []
    for pictures, count, fits in (
        (SMALL[1], small_balls, ((SCOUT, scouting), (SMALL[0], small))),
        (LARGE[1], large_balls, ((LARGE[0], large),)),
    ):
        with Progress(console=console) as progress:
            examples = draw(pictures, count, options.seed, options.processes, progress)
            nets += [fit(each, examples, epochs, options.seed, progress) for each, epochs in fits]
    scout, *judges = nets
    options.out.write_bytes(write_ball_nets(BallNets(scout, tuple(judges))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
