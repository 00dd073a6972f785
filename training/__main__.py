"""``python -m training --out FILE``: draw simulated examples, train the ball networks, write their weights.

With the default options it takes less than an hour on two cores, and the same seed gives the same networks except for
rounding, which depends on the machine. The networks that ship are of a narrower set of worlds (docs/detection.md).
Needs PyTorch.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from spinewatch.detection.refinement.network_file import write_networks
from spinewatch.detection.refinement.networks import BallNetworks
from spinewatch.detection.refinement.patches import PatchGrid
from spinewatch.simulation.images.examples import ExampleParameters
from training.draw import draw
from training.fit import Architecture, fit

PROPOSAL = Architecture(PatchGrid(25, 5.0), 0.0, ((5, 3, 12), (3, 1, 24), (3, 2, 32)), 48)
SMALL = (
    Architecture(PatchGrid(25, 5.0), 0.0, ((5, 2, 24), (3, 1, 48), (3, 2, 64)), 96),
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
        "--examples", type=int, nargs=2, default=(240_000, 56_000), metavar=("SMALL", "LARGE")
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
        console.print("fitting three networks")
    with ProcessPoolExecutor(options.processes, mp_context=get_context("spawn")) as pool:
        fits = [
            pool.submit(fit, architecture, examples, epochs, options.seed)
            for architecture, examples, epochs in (
                (SMALL[0], small_examples, small),
                (LARGE[0], large_examples, large),
                (PROPOSAL, small_examples, proposal),
            )
        ]
        networks = []
        for each in fits:
            network, errors = each.result()
            console.print(f"{network.grid.size} x {network.grid.size} {errors}", highlight=False)
            networks.append(network)
    options.out.write_bytes(write_networks(BallNetworks(networks[2], (networks[0], networks[1]))))
    return 0


if __name__ == "__main__":
    sys.exit(main())
