"""``python -m bench.thesis``: every published table beside ours, with the reason of every difference.

``--check`` ends with status 1 when a table is not reproduced within its stated tolerance. The published method is
scored on the scenes of DIR, by default the sample surgery.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from bench.tables import Bar, Grid, bars
from bench.thesis import (
    calibration,
    ceiling,
    colour,
    detection,
    look_up,
    matching,
    materials,
    motion,
    times,
    tsai,
    uncertainty,
)
from bench.thesis.printed import SAMPLES

Part = tuple[Sequence[Grid], Sequence[Bar]]

PARTS: Mapping[str, Callable[[Path], Part]] = {
    "calibration": lambda _: calibration.part(),
    "detection": detection.part,
    "matching": matching.part,
    "motion": lambda _: motion.part(),
    "times": lambda _: times.part(),
    "uncertainty": uncertainty.part,
    "tsai": lambda _: tsai.part(),
    "ceiling": lambda _: ceiling.part(),
    "look-up": look_up.part,
    "colour": lambda _: colour.part(),
    "materials": lambda _: materials.part(),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the tables; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m bench.thesis", description=__doc__)
    parser.add_argument("directory", type=Path, nargs="?", default=SAMPLES)
    parser.add_argument("--check", action="store_true", help="exit with 1 when a table is not reproduced")
    parser.add_argument("--part", choices=PARTS, help="print this part only")
    parser.add_argument("--markdown", action="store_true", help="print Markdown, for a document")
    options = parser.parse_args(arguments)
    checks: list[Bar] = []
    for name, part in PARTS.items():
        if options.part not in (None, name):
            continue
        grids, found = part(options.directory)
        for grid in grids:
            print(grid.markdown()) if options.markdown else grid.print()
        checks += found
    grid = bars(checks)
    print(grid.markdown()) if options.markdown else grid.print()
    return int(options.check and not all(bar.holds for bar in checks))


if __name__ == "__main__":
    sys.exit(main())
