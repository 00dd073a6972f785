"""``python -m training --out FILE``: draw simulated examples, train the ball networks, write their weights.

With the default options it takes less than an hour on two cores and gives the networks that ship with the library,
except for rounding, which depends on the machine. Needs PyTorch (docs/detection.md).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from spinewatch.detection.refinement.network_file import write_networks
from spinewatch.detection.refinement.networks import BallNetwork, BallNetworks
from spinewatch.detection.refinement.patches import PatchGrid
from spinewatch.simulation.images.examples import ExampleParameters
from training.draw import draw
from training.fit import Architecture, fit

PROPOSAL = Architecture(PatchGrid(25, 5.0), 0.0, ((5, 3, 8), (3, 1, 16), (3, 2, 24)), 32)
SMALL = (
    Architecture(PatchGrid(25, 5.0), 0.0, ((5, 2, 16), (3, 1, 32), (3, 2, 48)), 64),
    ExampleParameters(PatchGrid(25, 5.0), (7.0, 13.5), wider=32.0),
)
LARGE = (
    Architecture(PatchGrid(49, 10.0), 15.0, ((5, 2, 16), (3, 2, 24), (3, 1, 32), (3, 2, 48)), 64),
    ExampleParameters(PatchGrid(49, 10.0), (14.0, 36.0), wider=36.0),
)
"""The proposal network; the refinement network for balls of usual size, with the examples that train both of them; and
the refinement network for large images, which keeps their detail."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Train the networks and return the exit status.

    Parameters
    ----------
    arguments
        Command line; None for that of the process.

    Returns
    -------
    int
        0.
    """
    parser = argparse.ArgumentParser(prog="python -m training", description=__doc__)
    parser.add_argument("--out", type=Path, required=True, help="file to write")
    parser.add_argument(
        "--examples", type=int, nargs=2, default=(144_000, 36_000), metavar=("SMALL", "LARGE")
    )
    parser.add_argument(
        "--epochs", type=int, nargs=3, default=(16, 40, 60), metavar=("PROPOSAL", "SMALL", "LARGE")
    )
    parser.add_argument("--seed", type=int, default=1995)
    parser.add_argument("--processes", type=int, default=2, help="number of processes that draw examples")
    options = parser.parse_args(arguments)
    console = Console(stderr=True)
    proposal, small, large = options.epochs
    small_balls, large_balls = options.examples
    networks: list[BallNetwork] = []
    for parameters, count, fits in (
        (SMALL[1], small_balls, ((PROPOSAL, proposal), (SMALL[0], small))),
        (LARGE[1], large_balls, ((LARGE[0], large),)),
    ):
        with Progress(console=console) as progress:
            examples = draw(parameters, count, options.seed, options.processes, progress)
            networks += [fit(each, examples, epochs, options.seed, progress) for each, epochs in fits]
    options.out.write_bytes(write_networks(BallNetworks(networks[0], tuple(networks[1:]))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
