"""``python -m bench.accuracy DIR``: run both benchmarks and write docs/accuracy.md."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from bench import scenes, speed

DOCUMENT = Path(__file__).parents[1] / "docs" / "accuracy.md"

_SCENES = """\
# Accuracy and speed

`python -m bench.accuracy DIR` writes this page from rendered scenes under DIR; `samples/` contains the surgery D1.
They are path-traced images with exact truth, 568 x 416 pixels, of two rigs with baselines of 320 and 422 mm; they do
not show a patient. The detector's templates were made from D1, so that its figures are optimistic; `singles` are other
pairs, but they were used during development.

## Scenes

The first table gives the errors of position in mm and of rotation in degrees of each triad, in label order; `-` was
not found. `found` and all errors refer to triads whose six ball images are visible, with the correct label and within
2 mm. The rotation error is almost entirely tilt: the rotation about its own normal (`inplane`) of a flat triad is
measured several times better, and the tilt of a 28 mm marker follows from fractions of a pixel. Motion is since PRE,
relative to the reference triad; its translation at the far end of the spine contains the tilt error of the reference.
"""

_SPEED = """
## Speed

The peer does only a part of the work: ten masked, normalized correlations with a 19 x 19 template on each of the same
two images, in the same run.
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Write the document; return the exit status, 1 when a bar is missed."""
    parser = argparse.ArgumentParser(prog="python -m bench.accuracy", description=__doc__)
    parser.add_argument("directory", type=Path)
    parser.add_argument("--out", type=Path, default=DOCUMENT)
    parser.add_argument("--runs", type=int, default=speed.RUNS, help="runs of the speed benchmark")
    options = parser.parse_args(arguments)
    found, timed = scenes.measure(options.directory), speed.measure(options.runs)
    if not found.scores:
        parser.error(f"no truth.json with triads under {options.directory}")
    parts = [_SCENES, *(grid.markdown() for grid in found.grids)]
    parts += [_SPEED, *(grid.markdown() for grid in timed.grids)]
    options.out.write_text("\n".join(parts), encoding="utf-8")
    return 0 if all(bar.holds for bar in (*found.bars, *timed.bars)) else 1


if __name__ == "__main__":
    sys.exit(main())
