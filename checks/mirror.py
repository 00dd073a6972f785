"""Whether tests mirror modules one to one: ``python -m checks.mirror``.

``spinewatch/a/b.py`` is tested by ``tests/spinewatch/a/test_b.py``, and no test file there is without its module.
"""

from __future__ import annotations

import sys
from pathlib import Path

PROJECT = Path(__file__).parents[1]
ROOMS = ("spinewatch", "contract", "exports", "reports", "store", "workers")
DECLARATIONS = frozenset(
    {
        "spinewatch/arrays",
        "spinewatch/detection/refinement/centre_parameters",
        "spinewatch/errors",
        "spinewatch/flags/calibration",
        "spinewatch/flags/image",
        "spinewatch/flags/kind",
        "spinewatch/flags/spine",
        "spinewatch/flags/stage",
        "spinewatch/matching/selection_parameters",
        "spinewatch/parameters",
        "spinewatch/progress",
        "spinewatch/triads/diagnosis_parameters",
        "spinewatch/triads/label_parameters",
    }
)
"""Modules of declarations alone, which other modules' tests exercise."""


def main() -> int:
    """Print one line per module without a test file and per test file without a module; return 1 when there is any."""
    modules = {
        path.relative_to(PROJECT).with_suffix("").as_posix()
        for room in ROOMS
        for path in (PROJECT / room).rglob("*.py")
        if not path.stem.startswith("__")
    }
    tested = {
        path.relative_to(PROJECT / "tests").with_name(path.stem.removeprefix("test_")).as_posix()
        for room in ROOMS
        for path in (PROJECT / "tests" / room).rglob("test_*.py")
    }
    lines = [f"{module}.py has no test file of its own" for module in sorted(modules - tested - DECLARATIONS)]
    lines += [f"tests of {module}: there is no such module" for module in sorted(tested - modules)]
    sys.stdout.write("".join(f"{line}\n" for line in lines))
    return int(bool(lines))


if __name__ == "__main__":
    sys.exit(main())
