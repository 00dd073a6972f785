"""``python -m bench.load``: the service under load, beside what is promised of it.

One cart, two workers beside two bare processes, many carts, kill -9 in rounds, the summary in a large record, and, with
``--hours``, memory over time. Every part has a service of its own with a new database.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from types import FrameType
from typing import Protocol

from bench import load_carts, load_kills, load_latency, load_soak, load_summary, load_throughput
from bench.load_service import LoadService
from bench.tables import Bar, Grid, bars


class Part(Protocol):
    """What a part of the benchmark found."""

    @property
    def bars(self) -> tuple[Bar, ...]:
        """The bars and whether they are reached."""

    @property
    def grids(self) -> tuple[Grid, ...]:
        """The tables."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit status."""
    options = _parser().parse_args(arguments)
    signal.signal(signal.SIGTERM, _leave)  # so that the services end too
    checks: list[Bar] = []
    for name, run in _parts(options).items():
        if options.part not in {None, name}:
            continue
        with (
            tempfile.TemporaryDirectory(dir=options.folder, ignore_cleanup_errors=True) as folder,
            LoadService(
                Path(folder), database_url=options.database_url, queue_url=options.queue_url
            ) as service,
        ):
            found = run(service)
        for grid in found.grids:
            grid.print()
        checks.extend(found.bars)
    bars(checks).print()
    if options.json:
        rows = [{"bar": bar.promise, "reached": bar.reached, "holds": bar.holds} for bar in checks]
        options.json.write_text(json.dumps(rows, indent=2) + "\n")
    return 0 if all(bar.holds for bar in checks) or not options.check else 1


def _parts(options: argparse.Namespace) -> Mapping[str, Callable[[LoadService], Part]]:
    parts: dict[str, Callable[[LoadService], Part]] = {
        "latency": lambda service: load_latency.measure(service, load_latency.PAIRS, options.seed),
        "throughput": lambda service: load_throughput.measure(service, seed=options.seed),
        "carts": lambda service: load_carts.measure(service, seed=options.seed),
        "summary": lambda service: load_summary.measure(service, options.surgeries, seed=options.seed),
        "kills": lambda service: _kills(service, options),
    }
    if options.hours or options.part == "soak":
        hours = options.hours or _SOAK_HOURS
        parts["soak"] = lambda service: load_soak.measure(service, hours, options.seed)
    return parts


def _kills(service: LoadService, options: argparse.Namespace) -> Part:
    with ExitStack() as stack:
        others = [stack.enter_context(service.another()) for _ in range(1, options.services)]
        return load_kills.run([service, *others], options.rounds, options.seed)


_NAMES = ("latency", "throughput", "carts", "summary", "kills", "soak")
_SOAK_HOURS = 2.0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m bench.load", description=__doc__)
    parser.add_argument("--check", action="store_true", help="exit with 1 when a bar is missed")
    parser.add_argument("--json", type=Path, help="write the bars here")
    parser.add_argument("--part", choices=_NAMES, help="measure this part only")
    parser.add_argument("--rounds", type=int, default=load_kills.ROUNDS, help="rounds of kill -9")
    parser.add_argument(
        "--services",
        type=int,
        default=1,
        help="services that are killed side by side; their load slows all ends",
    )
    parser.add_argument(
        "--surgeries", type=int, default=load_summary.SURGERIES, help="size of the large record"
    )
    parser.add_argument(
        "--hours", type=float, default=0.0, help="time under load for the memory; 0 leaves it out"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--folder", type=Path, help="where databases are made; by default in the temporary folder"
    )
    parser.add_argument("--database-url", help="an empty database for one part, in place of an SQLite file")
    parser.add_argument("--queue-url", help="a queue for one part, in place of a file beside the database")
    return parser


def _leave(number: int, _: FrameType | None) -> None:
    sys.exit(128 + number)


if __name__ == "__main__":
    sys.exit(main())
