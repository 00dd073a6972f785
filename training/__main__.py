"""``python -m training --out FILE``: draw simulated examples, train the ball networks, write their weights.

For each size of balls two refinement networks are fitted, one to all examples and one to those with a usual look, of
glossy balls in clean and sharp images; their mean is more accurate than either in both. With the default options it
takes one to two hours on two cores, and the same seed gives the same networks except for rounding, which
depends on the machine. docs/detection.md says what the networks that ship were fitted to. Needs PyTorch.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from spinewatch.detection.refinement.network_file import write_networks
from spinewatch.detection.refinement.networks import BallNetworks
from spinewatch.detection.refinement.patches import PatchGrid
from spinewatch.simulation.images.examples import FAMILIES, ExampleParameters
from training.draw import draw
from training.fit import Architecture
from training.fit_all import Fit, fit_all

PROPOSAL = Architecture(PatchGrid(25, 5.0), 0.0, ((5, 3, 12), (3, 1, 24), (3, 2, 32)), 48)
SMALL = (
    Architecture(PatchGrid(25, 5.0), 0.0, ((5, 2, 32), (3, 1, 56), (3, 2, 80)), 112),
    ExampleParameters(PatchGrid(25, 5.0), (7.0, 13.5), wider=32.0),
)
LARGE = (
    Architecture(PatchGrid(49, 10.0), 15.0, ((5, 2, 16), (3, 2, 24), (3, 1, 32), (3, 2, 48)), 64),
    ExampleParameters(PatchGrid(49, 10.0), (14.0, 36.0), wider=36.0),
)
"""The proposal network; the refinement network for balls of usual size, with the examples that train both of them; and
the refinement network for large images, which keeps their detail."""
UNUSUAL = tuple(family for family in FAMILIES if family != "glossy")
"""Families of looks that the networks for usual looks are not trained on."""


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
        "--examples", type=int, nargs=2, default=(320_000, 64_000), metavar=("SMALL", "LARGE")
    )
    parser.add_argument(
        "--epochs", type=int, nargs=3, default=(16, 48, 48), metavar=("PROPOSAL", "SMALL", "LARGE")
    )
    parser.add_argument("--seed", type=int, default=1995)
    parser.add_argument("--processes", type=int, default=2, help="number of processes that draw examples")
    options = parser.parse_args(arguments)
    console = Console(stderr=True)
    proposal, small, large = options.epochs
    small_balls, large_balls = options.examples
    with Progress(console=console) as progress:
        small_examples, large_examples = (
            draw(parameters, count, options.seed, options.processes, progress)
            for parameters, count in ((SMALL[1], small_balls), (LARGE[1], large_balls))
        )
        fits = (
            Fit(SMALL[0], small_examples, small),
            Fit(LARGE[0], large_examples, large),
            Fit(PROPOSAL, small_examples, proposal),
            Fit(SMALL[0], small_examples, small, UNUSUAL),
            Fit(LARGE[0], large_examples, large, UNUSUAL),
        )
        fitted = fit_all(fits, options.seed, options.processes, progress)
    for network, errors in fitted:
        console.print(f"{network.grid.size} x {network.grid.size} {errors}", highlight=False)
    small_network, large_network, proposing, *usual = (network for network, _ in fitted)
    options.out.write_bytes(write_networks(BallNetworks(proposing, (small_network, large_network, *usual))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
