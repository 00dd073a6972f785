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

from spinewatch.detection.ball_net import BallNet, write_ball_nets
from spinewatch.detection.patches import PatchGrid
from spinewatch.simulation.pictures.examples import ExampleParameters
from training.draw import draw
from training.fit import Architecture, fit

SMALL = (
    Architecture(PatchGrid(25, 5.0), 0.0, ((5, 2, 16), (3, 1, 32), (3, 2, 48)), 64),
    ExampleParameters(PatchGrid(25, 5.0), (7.0, 13.5), wider=32.0),
)
LARGE = (
    Architecture(PatchGrid(49, 10.0), 15.0, ((5, 2, 16), (3, 2, 24), (3, 1, 32), (3, 2, 48)), 64),
    ExampleParameters(PatchGrid(49, 10.0), (14.0, 36.0), wider=36.0),
)
"""The network for balls of usual size, and the one for large pictures, which keeps their detail."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Train both networks; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m training", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="file of the weights")
    parser.add_argument("--examples", type=int, nargs=2, default=(96_000, 24_000), metavar=("SMALL", "LARGE"))
    parser.add_argument("--epochs", type=int, nargs=2, default=(24, 24), metavar=("SMALL", "LARGE"))
    parser.add_argument("--seed", type=int, default=1995)
    parser.add_argument("--processes", type=int, default=2, help="that draw examples")
    options = parser.parse_args(arguments)
    console = Console(stderr=True)
    nets: list[BallNet] = []
    for (architecture, pictures), count, epochs in zip(
        (SMALL, LARGE), options.examples, options.epochs, strict=True
    ):
        with Progress(console=console) as progress:
            examples = draw(pictures, count, options.seed, options.processes, progress)
            nets.append(fit(architecture, examples, epochs, options.seed, progress))
    options.out.write_bytes(write_ball_nets(nets))
    return 0


if __name__ == "__main__":
    sys.exit(main())
