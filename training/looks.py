"""``python -m training.looks``: errors of the refinement network on looks that it was not trained on.

One network is fitted to all families of looks, and one without each family; all are smaller fits than those that ship.
The table has the errors on the held-out examples of each family: trained on it, and not. Needs PyTorch.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from spinewatch.simulation.images.families import FAMILIES
from training.__main__ import SMALL, SMALL_EXAMPLES
from training.draw import draw
from training.errors import CentreErrors, FitErrors
from training.fit_all import Fit, fit_all


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table and return the exit status.

    Parameters
    ----------
    arguments
        Command line; None for that of the process.

    Returns
    -------
    int
        0.
    """
    parser = argparse.ArgumentParser(prog="python -m training.looks", description=__doc__)
    parser.add_argument("--examples", type=int, default=60_000)
    parser.add_argument("--epochs", type=int, default=12)
    parser.add_argument("--seed", type=int, default=1995)
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args(arguments)
    with Progress(console=Console(stderr=True)) as progress:
        examples = draw(SMALL_EXAMPLES, options.examples, options.seed, options.processes, progress)
        fits = [Fit(SMALL, examples, options.epochs)]
        fits += [Fit(SMALL, examples, options.epochs, (family,)) for family in FAMILIES]
        errors = [errors for _, errors in fit_all(fits, options.seed, options.processes, progress)]
    Console().print(_table(errors[0], dict(zip(FAMILIES, errors[1:], strict=True))))
    return 0


def _table(of_all: FitErrors, without: dict[str, FitErrors]) -> Table:
    """Return the errors on each family, trained on it and not."""
    table = Table(title="Held-out examples: trained on the family, and on the others only")
    for heading in ("family", "balls", "found", "median error, radii", "chi2 / dof", "inside 95% regions"):
        table.add_column(heading)
    for name, left_out in without.items():
        with_it, without_it = of_all.families[name], left_out.families[name]
        pairs = zip(_cells(with_it), _cells(without_it), strict=True)
        table.add_row(name, str(with_it.balls), *(f"{a}, {b}" for a, b in pairs))
    return table


def _cells(errors: CentreErrors) -> tuple[str, str, str, str]:
    return (
        f"{errors.found:.1%}",
        f"{errors.median_radii:.4f}",
        f"{errors.chi2_per_dof:.2f}",
        f"{errors.within_95:.1%}",
    )


if __name__ == "__main__":
    sys.exit(main())
