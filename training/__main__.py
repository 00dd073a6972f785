"""``python -m training --out FILE``: draw simulated examples, train the ball networks, write their weights.

For each size of balls two refinement networks are fitted, one to examples of all looks and one to examples of usual
looks, of glossy balls in clean and sharp images; their mean is more accurate than either in both. With the default
options it takes about two hours on two cores, and the same seed gives the same networks except for rounding, which
depends on the machine. docs/detection.md says what the networks that ship were fitted to. Needs PyTorch.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from spinewatch.detection.refinement.network_file import write_networks
from spinewatch.detection.refinement.networks import BallNetworks
from spinewatch.detection.refinement.patches import PatchGrid
from spinewatch.simulation.images.examples import FAMILIES, ExampleParameters, Examples
from training.draw import draw
from training.fit import Architecture
from training.fit_all import Fit, fit_all

SMALL_GRID, LARGE_GRID = PatchGrid(25, 5.0), PatchGrid(49, 10.0)
"""Samples of patches of balls of usual size, and of those in large images, which keep their detail."""
PROPOSAL = Architecture(SMALL_GRID, 0.0, ((5, 3, 12), (3, 1, 24), (3, 2, 32)), 48)
SMALL = Architecture(SMALL_GRID, 0.0, ((3, 1, 24), (3, 2, 48), (3, 1, 64), (3, 2, 96)), 128)
SMALL_USUAL = Architecture(SMALL_GRID, 0.0, ((5, 2, 16), (3, 1, 32), (3, 2, 48)), 64)
LARGE = Architecture(LARGE_GRID, 15.0, ((5, 2, 16), (3, 2, 24), (3, 1, 32), (3, 2, 48)), 64)
"""The proposal network, and the refinement networks for balls of usual size, of all and of usual looks, and for large
images. That of usual looks is small, because it sees all balls of all images."""
SMALL_EXAMPLES = ExampleParameters(SMALL_GRID, (7.0, 13.5), wider=32.0)
LARGE_EXAMPLES = ExampleParameters(LARGE_GRID, (14.0, 36.0), wider=36.0)
UNUSUAL = tuple(family for family in FAMILIES if family != "glossy")
"""Families of looks that the networks for usual looks are not trained on."""
USUAL_SHARE = 0.4
"""Number of examples of usual looks over that of all looks."""


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
        "--epochs", type=int, nargs=3, default=(16, 44, 48), metavar=("PROPOSAL", "SMALL", "LARGE")
    )
    parser.add_argument("--seed", type=int, default=1995)
    parser.add_argument("--processes", type=int, default=2, help="number of processes that draw examples")
    options = parser.parse_args(arguments)
    console = Console(stderr=True)
    proposal, small, large = options.epochs
    small_balls, large_balls = options.examples
    with Progress(console=console) as progress:

        def drawn(parameters: ExampleParameters, count: int) -> tuple[Examples, Examples]:
            usual = replace(parameters, left_out=UNUSUAL)
            return (
                draw(parameters, count, options.seed, options.processes, progress),
                draw(usual, round(USUAL_SHARE * count), options.seed, options.processes, progress),
            )

        small_all, small_usual = drawn(SMALL_EXAMPLES, small_balls)
        large_all, large_usual = drawn(LARGE_EXAMPLES, large_balls)
        fits = (
            Fit(SMALL, small_all, small),
            Fit(LARGE, large_all, large),
            Fit(PROPOSAL, small_all, proposal),
            Fit(SMALL_USUAL, small_usual, small),
            Fit(LARGE, large_usual, large),
        )
        fitted = fit_all(fits, options.seed, options.processes, progress)
    for network, errors in fitted:
        console.print(f"{network.grid.size} x {network.grid.size} {errors}", highlight=False)
    small_network, large_network, proposing, *usual = (network for network, _ in fitted)
    options.out.write_bytes(write_networks(BallNetworks(proposing, (small_network, large_network, *usual))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
