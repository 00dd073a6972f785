"""``python -m bench.spine``: the spine at each stage, on simulated surgeries and on the sample surgery.

``--check`` ends with status 1 when a bar is missed. The parts are run by two processes.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path

from bench import (
    spine_attribution,
    spine_axes,
    spine_bursts,
    spine_cobb,
    spine_coverage,
    spine_invariance,
    spine_planes,
    spine_plausibility,
    spine_sample,
    spine_setups,
    spine_thesis,
    spine_triads,
)
from bench.tables import Bar, Grid, bars

PROCESSES = 2


@dataclass(frozen=True)
class Sizes:
    """How much is simulated.

    Attributes
    ----------
    triads
        Triads whose poses are checked.
    trials
        Noisy measurements of each motion of the controlled test.
    spines
        Spines of each kind for the Cobb angles without noise.
    surgeries
        Surgeries with the rig's noise.
    planes
        Small curves of each size, plane and ratio of the errors.
    bursts
        Surgeries with bursts for the deviation by the number of pairs.
    breathing
        Surgeries with bursts of a breathing patient.
    manoeuvres
        Spines on which each known manoeuvre is done.
    moved
        Surgeries of each kind that are moved, mirrored and renamed.
    gates
        Surgeries with each set of markers for the plausibility gates.
    erring
        Surgeries whose patient axes err, for the intervals.
    axes
        Surgeries whose patient axes are checked.
    setups
        Surgeries whose setups have mistakes.
    """

    triads: int = 4000
    trials: int = 500
    spines: int = 150
    surgeries: int = 1000
    planes: int = 3000
    bursts: int = 60
    breathing: int = 120
    manoeuvres: int = 30
    moved: int = 20
    gates: int = 300
    erring: int = 800
    axes: int = 300
    setups: int = 1000


Part = tuple[list[Grid], tuple[Bar, ...]]


def _triads(sizes: Sizes) -> Part:
    return spine_triads.pose_coverage(sizes.triads)


def _thesis(sizes: Sizes) -> Part:
    return spine_thesis.grids_and_bars(spine_thesis.trials(sizes.trials))


def _cobb(sizes: Sizes) -> Part:
    return spine_cobb.grids_and_bars(spine_cobb.cobb_errors(sizes.spines))


def _coverage(sizes: Sizes) -> Part:
    grids, checks = spine_coverage.grids_and_bars(spine_coverage.coverage(sizes.surgeries))
    of_planes, plane_checks = spine_planes.grids_and_bars(spine_planes.planes(sizes.planes))
    return [*grids, *of_planes], (*checks, *plane_checks)


def _attribution(sizes: Sizes) -> Part:
    return spine_attribution.grids_and_bars(spine_attribution.parts_of_manoeuvres(sizes.manoeuvres))


def _bursts(sizes: Sizes) -> Part:
    return spine_bursts.grids_and_bars(spine_bursts.falls(sizes.bursts), spine_bursts.biases(sizes.breathing))


def _sample(_: Sizes) -> Part:
    return spine_sample.grids_and_bars(spine_sample.sample_motions())


def _invariance(sizes: Sizes) -> Part:
    return spine_invariance.grids_and_bars(spine_invariance.changes(sizes.moved))


def _axes(sizes: Sizes) -> Part:
    return spine_axes.parts(sizes.erring, sizes.axes)


def _plausibility(sizes: Sizes) -> Part:
    return spine_plausibility.gates(sizes.gates)


def _setups(sizes: Sizes) -> Part:
    return spine_setups.grids_and_bars(spine_setups.rates(sizes.setups))


PARTS: Mapping[str, Callable[[Sizes], Part]] = {
    "triads": _triads,
    "thesis": _thesis,
    "cobb": _cobb,
    "coverage": _coverage,
    "attribution": _attribution,
    "bursts": _bursts,
    "sample": _sample,
    "invariance": _invariance,
    "plausibility": _plausibility,
    "axes": _axes,
    "setups": _setups,
}
"""The parts by name, in the order in which they are printed."""

_LONGEST_FIRST = ("coverage", "axes", "setups", "cobb", "bursts")


def measure(names: Sequence[str], sizes: Sizes, processes: int = PROCESSES) -> tuple[list[Grid], list[Bar]]:
    """Run parts; return their tables and bars."""
    order = sorted(names, key=lambda name: name not in _LONGEST_FIRST)
    with ProcessPoolExecutor(processes, mp_context=get_context("spawn")) as pool:
        running = {name: pool.submit(PARTS[name], sizes) for name in order}
        found = {name: future.result() for name, future in running.items()}
    grids: list[Grid] = []
    checks: list[Bar] = []
    for name in (name for name in PARTS if name in found):
        grids += found[name][0]
        checks += found[name][1]
    return grids, checks


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m bench.spine", description=__doc__)
    parser.add_argument("--check", action="store_true", help="exit with 1 when a bar is missed")
    parser.add_argument(
        "--part", action="append", choices=list(PARTS), help="run this part only; may be repeated"
    )
    parser.add_argument("--spines", type=int, default=Sizes.spines, help="spines of each kind without noise")
    parser.add_argument("--surgeries", type=int, default=Sizes.surgeries, help="surgeries with noise")
    parser.add_argument("--json", type=Path, help="write the bars here")
    options = parser.parse_args(arguments)
    sizes = Sizes(spines=options.spines, surgeries=options.surgeries)
    grids, checks = measure(options.part or list(PARTS), sizes)
    for grid in (*grids, bars(checks)):
        grid.print()
    if options.json:
        reached = {bar.promise: {"reached": bar.reached, "holds": bool(bar.holds)} for bar in checks}
        options.json.write_text(json.dumps(reached, indent=2) + "\n")
    return 0 if all(bar.holds for bar in checks) or not options.check else 1


if __name__ == "__main__":
    sys.exit(main())
