"""``python -m training --out FILE``: draw simulated examples, train the ball networks, write their weights.

Two refinement networks are fitted for balls of usual size: one to examples of all looks, and one to examples of usual
looks, of glossy balls in clean and sharp images. A third is for large balls of all looks. The odds of all networks are
then fitted again, to examples whose places without a ball the proposal network takes for one. With the default options
it takes less than three hours on two cores, and the same seed gives the same networks except for rounding, which
depends on the machine. docs/networks.md says what the networks that ship were fitted to. Needs PyTorch.
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
from spinewatch.simulation.images.examples import Examples
from spinewatch.simulation.images.families import UNUSUAL
from spinewatch.simulation.images.shots import ExampleParameters
from training.draw import draw
from training.fit_all import Fit, fit_all
from training.model import Architecture
from training.odds import refit_odds

SMALL_GRID, LARGE_GRID = PatchGrid(25, 5.0), PatchGrid(49, 10.0)
"""Samples of patches of balls of usual size, and of those in large images, which keep their detail."""
PROPOSAL = Architecture(SMALL_GRID, 0.0, False, ((5, 3, 12), (3, 1, 24), (3, 2, 32)), 48)
SMALL = Architecture(SMALL_GRID, 0.0, True, ((3, 1, 24), (3, 2, 48), (3, 1, 64), (3, 2, 96)), 128)
SMALL_USUAL = Architecture(SMALL_GRID, 0.0, True, ((5, 2, 16), (3, 1, 32), (3, 2, 48)), 64)
LARGE = Architecture(LARGE_GRID, 15.0, True, ((5, 2, 32), (3, 1, 48), (3, 2, 64), (3, 2, 96)), 128)
"""The proposal network, and the refinement networks for balls of usual size, of all and of usual looks, and for large
balls. That of usual looks is small, because it sees all balls of all images of the cart."""
SMALL_EXAMPLES = ExampleParameters(SMALL_GRID, (7.0, 13.5), wider=32.0)
LARGE_EXAMPLES = ExampleParameters(LARGE_GRID, (14.0, 36.0), wider=36.0)
PRESENT_AMONG_HARD = 0.6
"""Fraction of the worlds with a ball, among the examples with hard negatives."""


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
        "--examples",
        type=int,
        nargs=3,
        default=(640_000, 80_000, 160_000),
        metavar=("SMALL", "USUAL", "LARGE"),
        help="examples of all looks, further ones of usual looks, those of large balls",
    )
    parser.add_argument(
        "--hard",
        type=int,
        nargs=2,
        default=(60_000, 12_000),
        metavar=("SMALL", "LARGE"),
        help="examples with hard negatives, those of large balls",
    )
    parser.add_argument(
        "--epochs",
        type=int,
        nargs=4,
        default=(5, 12, 40, 20),
        metavar=("PROPOSAL", "SMALL", "USUAL", "LARGE"),
    )
    parser.add_argument("--seed", type=int, default=1995)
    parser.add_argument("--processes", type=int, default=2, help="number of processes that draw examples")
    options = parser.parse_args(arguments)
    console = Console(stderr=True)
    proposal, small, usual, large = options.epochs
    with Progress(console=console) as progress:
        of_all, of_usual, of_large = (
            draw(parameters, count, options.seed, options.processes, progress)
            for parameters, count in zip(
                (SMALL_EXAMPLES, replace(SMALL_EXAMPLES, left_out=UNUSUAL), LARGE_EXAMPLES),
                options.examples,
                strict=True,
            )
        )
        fits = (
            Fit(SMALL, of_all, small),
            Fit(LARGE, of_large, large),
            Fit(SMALL_USUAL, Examples.concatenate([of_all.without(UNUSUAL), of_usual]), usual, UNUSUAL),
            Fit(PROPOSAL, of_all, proposal),
        )
        fitted = fit_all(fits, options.seed, options.processes, progress)
        proposing = fitted[-1][0]
        of_hard, of_large_hard = (
            draw(
                replace(parameters, present=PRESENT_AMONG_HARD, hard_for=proposing),
                count,
                options.seed,
                options.processes,
                progress,
            )
            for parameters, count in zip((SMALL_EXAMPLES, LARGE_EXAMPLES), options.hard, strict=True)
        )
    networks = []
    for (network, errors), each in zip(fitted, fits, strict=True):
        examples = of_hard if network.grid == SMALL_GRID else of_large_hard
        refitted, before, after = refit_odds(network, examples.without(each.left_out), options.seed)
        console.print(f"{network.grid.size} x {network.grid.size} {errors}", highlight=False)
        console.print(f"hard negatives before: {before}; after: {after}", highlight=False)
        networks.append(refitted)
    *refining, proposing = networks
    options.out.write_bytes(write_networks(BallNetworks(proposing, tuple(refining))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
