"""``python -m bench.mistakes``: mistakes of people and machines, and the answer to each.

Every slip is made from sound samples and given to the command line or to a running service. Right answers are:
refused with a sentence that names the mistake, flagged, or read correctly. Silent, wrong (another sentence or flag) and
crash (a traceback) are failures. ``--check`` ends with status 1 when a bar is missed.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from rich.console import Console
from rich.progress import MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from bench.slips import (
    calibrations,
    camera_files,
    edits,
    images,
    labels,
    markers,
    rigs,
    service,
    setups,
    simulated,
    system,
    tables,
)
from bench.slips.controls import controls
from bench.slips.page import PAGE, page
from bench.slips.run import run_slip
from bench.slips.simulated import Rate
from bench.slips.slip import Outcome, Slip, to_json
from bench.tables import Bar, Grid, bars

VERDICTS = ("refused", "flagged", "read", "silent", "wrong", "crash")
MIN_SLIPS, MIN_PAIRS = 70, 6
MAX_SECONDS = 60.0

Step = Callable[[], object]

UNSEEN = (
    (
        "all names in reverse order",
        "one stage shows neither head nor feet; an earlier stage, or the direction declared for a spine decides",
    ),
    (
        "all names shifted by one level",
        "no spacing changes; radiographs or an earlier stage decide",
    ),
    (
        "all vertebrae of initial poses in patient axes named a level off",
        "the triads place them; only the shape of the spine is left, which tells in 1%",
    ),
    (
        "results of stages given to `spinewatch spine` in another order than they were taken",
        "they have no times; each change is right for the order given. The service compares the times of capture",
    ),
    (
        "both images of another moment, of the same patient",
        "the images are a consistent stage; only their times can be checked",
    ),
    (
        "images of another surgery",
        "the same pair is measured again as another surgery in research, and with the sample; what is stored of one"
        " surgery tells nothing of another, which may be purged; the SHA-256 of each image is in its stage",
    ),
    (
        "half a pixel between the pixel origins of two programs",
        "the principal point absorbs it; the residuals do not change",
    ),
    (
        "a control field made 1% too large",
        "nothing in the calibration contradicts it; the marker lengths of the first stage, 1.01 of their size, do",
    ),
    (
        "one calibration shot whose two sides show the board in two positions",
        "each camera fits alone (418.6 ± 0.3 mm for 422 mm); a second shot or the first stage shows it",
    ),
    (
        "one focal length 1% too long",
        "errors of 1.9 mm, 8 sd; the markers are 0.5% short, 2.8 sd of what 4 triads show; from 1.5% it is flagged",
    ),
    (
        "the sign of a small K1 in the rig of all stages",
        "errors of 1.0 mm, 4 sd, at 0.11 px; the markers are 0.34% short, 2 to 3 sd of what 4 triads show; in one stage"
        " it is flagged",
    ),
    (
        "both images of a stage 1% too wide",
        "errors of 1.3 mm, 10 sd; the markers are 0.45% long, and 1.0 ± 0.4% longer across the rows than along: flagged"
        " in 28% of stages with 4 triads",
    ),
    (
        "rows of one image displaced by 1 px",
        "errors of 1.5 mm; seen in 58% of images, displacements of 2 px and more in 95%",
    ),
    (
        "the whole right image shifted by up to a few columns",
        "every depth changes alike, 3 mm for all triads; rows and marker lengths hardly do",
    ),
    (
        "columns dropped within one image",
        "what lies beside them is shifted along its row, which is the depth; a triad there keeps its size",
    ),
    (
        "rows shifted in both images alike",
        "the pair agrees as before; the triads are all moved together",
    ),
    (
        "columns shifted in both images alike, by up to 5",
        "the same; 4.7 mm for all triads, and 0.45 mm between two stages",
    ),
    (
        "the marker of an end vertebra bumped by 10 degrees and 5 mm between two stages",
        "it has one neighbour, and real segments move as much; the change of Cobb is off by 4 degrees (median)",
    ),
    (
        "left and right of the patient exchanged where triads are seen from the side",
        "the anterior axis is tested against the way the triads face; from the side it agrees with both",
    ),
    (
        "the axial rotations of all initial poses negated",
        "they are 3 to 10 degrees, with errors of 3; how they go with a curve differs as much between patients: seen in"
        " 0 of 24 simulated surgeries",
    ),
    (
        "patient axes turned by 20 degrees about cephalad, with initial poses in patient axes",
        "the baseline is right whatever they are; triads on a spine that is nearly a line show it in 4%",
    ),
    (
        "patient axes inclined by 20 degrees, with initial poses in object axes",
        "a part of a curve is inclined as much; seen in 29%; the Cobb angle stays right, balance does not",
    ),
    (
        "initial poses that are mirrored, of a spine that is nearly straight",
        "the triads lie as far from either; seen in 27% with tilts over less than 30 degrees, in 75% of larger curves",
    ),
    (
        "initial poses of another patient with a similar curve",
        "clamps differ as much; 31 to 48% of other patients are seen",
    ),
    (
        "halved coronal tilts of a few initial poses",
        "end plates differ from the line of the bodies by 6 degrees; seen in 34% of curves over more than 30 degrees",
    ),
)
"""Mistakes that nothing in the input reveals, and why; docs/mistakes.md has the same table."""


@dataclass(frozen=True, eq=False)
class Result:
    """Results of a run.

    Attributes
    ----------
    outcomes
        One per slip.
    sound
        One per sound input.
    rates
        Flags on sound simulated stages first, then on those of moved cameras; empty without them.
    whole
        Whether every kind was run, so that the bars on counts apply.
    """

    outcomes: Sequence[Outcome]
    sound: Sequence[Outcome]
    rates: Sequence[Rate]
    whole: bool

    @cached_property
    def counts(self) -> Counter[str]:
        """Number of slips by verdict."""
        return Counter(outcome.verdict for outcome in self.outcomes)

    @cached_property
    def bars(self) -> tuple[Bar, ...]:
        """The bars."""
        return tuple(self._bars())

    def _bars(self) -> Iterator[Bar]:
        if self.whole:
            pairs = {outcome.slip.pair for outcome in self.outcomes} - {"-"}
            yield Bar(f"at least {MIN_SLIPS} slips", str(len(self.outcomes)), len(self.outcomes) >= MIN_SLIPS)
            yield Bar(f"on at least {MIN_PAIRS} pairs", str(len(pairs)), len(pairs) >= MIN_PAIRS)
        for verdict in ("silent", "wrong", "crash"):
            yield Bar(f"0 {verdict}", str(self.counts[verdict]), not self.counts[verdict])
        slowest = max((outcome.answer.seconds for outcome in self.outcomes), default=0.0)
        yield Bar(
            f"an answer within {MAX_SECONDS:.0f} s of processor time",
            f"{slowest:.1f} s",
            slowest <= MAX_SECONDS,
        )
        if self.sound:
            alarms = [
                outcome.slip.name for outcome in self.sound if outcome.verdict not in ("read", "flagged")
            ]
            yield Bar("no flag on a sound input", ", ".join(alarms) or "none", not alarms)
        if self.rates:
            alarm, *moved = self.rates
            promise = f"a flag on at most 1% of {alarm.stages} sound simulated stages"
            yield Bar(promise, f"{alarm.percent:.1f}%", alarm.percent <= 1)
            for rate in moved:
                yield Bar(
                    f"{rate.name}, 4 triads: flagged in >= 95%", f"{rate.percent:.1f}%", rate.percent >= 95
                )

    @property
    def grids(self) -> Iterator[Grid]:
        """The tables."""
        order = sorted(
            self.outcomes, key=lambda outcome: (outcome.slip.kind, VERDICTS.index(outcome.verdict))
        )
        rows = ((o.slip.kind, o.slip.name, o.slip.command, o.verdict, _short(o.figures)) for o in order)
        yield Grid.of("Slips", ["kind", "slip", "command", "verdict", "answer"], rows)
        kinds = sorted({outcome.slip.kind for outcome in self.outcomes})
        by_kind = Counter[tuple[str, str]]((o.slip.kind, o.verdict) for o in self.outcomes)
        sums = ((kind, *(by_kind[kind, verdict] for verdict in VERDICTS)) for kind in kinds)
        yield Grid.of(
            "Slips by kind", ["kind", *VERDICTS], (*sums, ("all", *(self.counts[v] for v in VERDICTS)))
        )
        if self.sound:
            yield Grid.of(
                "Sound input",
                ["input", "verdict", "answer"],
                ((o.slip.name, o.verdict, _short(o.figures)) for o in self.sound),
            )
        if self.rates:
            rates = ((r.name, r.stages, f"{r.percent:.1f}%", _codes(r)) for r in self.rates)
            yield Grid.of("Simulated stages", ["", "n", "raised", "flags"], rates)
        yield Grid.of("What nothing in the input reveals", ["slip", "why"], UNSEEN)
        yield bars(self.bars)


def all_slips() -> tuple[Slip, ...]:
    """Return every slip."""
    modules = (
        labels,
        markers,
        edits,
        rigs,
        images,
        tables,
        camera_files,
        calibrations,
        service,
        setups,
        system,
    )
    return tuple(slip for module in modules for slip in module.slips())


def measure(kinds: Sequence[str], *, simulate: bool, http: bool, step: Step, only: str = "") -> Result:
    """Run slips, the sound input and the simulated stages.

    Parameters
    ----------
    kinds
        Kinds of slips to run; all if empty.
    simulate
        Whether simulated stages are measured.
    http
        Whether the slips that need a running service are run.
    step
        Called after each slip and each simulated stage.
    only
        Part of the names of the slips to run.

    Returns
    -------
    Result
        All outcomes.
    """
    chosen = selected(kinds, http=http, only=only)
    outcomes = []
    for slip in chosen:
        if slip.ask is None:
            outcomes.append(_in_folder(slip))
            step()
    asked = [slip for slip in chosen if slip.ask is not None]
    if asked:
        with tempfile.TemporaryDirectory() as folder, service.running(Path(folder)) as running:
            for slip in asked:
                outcomes.append(service.ask_slip(slip, running, Path(folder)))
                step()
    whole = not kinds and not only and http
    sound = [_in_folder(slip) for slip in controls()] if not kinds and not only else []
    return Result(outcomes, sound, _rates(step) if simulate else (), whole)


def selected(kinds: Sequence[str], *, http: bool, only: str = "") -> tuple[Slip, ...]:
    """Return the slips to run."""
    return tuple(
        slip
        for slip in all_slips()
        if (not kinds or slip.kind in kinds) and (http or slip.ask is None) and only in slip.name
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmark; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m bench.mistakes", description=__doc__)
    parser.add_argument("--check", action="store_true", help="exit status 1 when a bar is missed")
    parser.add_argument("--json", type=Path, help="write every outcome here")
    parser.add_argument("--page", action="store_true", help=f"write docs/{PAGE.name}; needs all slips")
    parser.add_argument("--kind", action="append", default=[], help="run this kind only; may be repeated")
    parser.add_argument("--only", default="", help="run slips with this in their name")
    parser.add_argument(
        "--no-service", action="store_true", help="leave out slips that need a running service"
    )
    parser.add_argument("--no-simulated", action="store_true", help="leave out the simulated stages")
    options = parser.parse_args(arguments)
    http, simulate = (
        not options.no_service,
        not options.no_simulated and not options.kind and not options.only,
    )
    total = len(selected(options.kind, http=http, only=options.only))
    total += simulated.SOUND + 2 * simulated.MOVED if simulate else 0
    columns = (
        TextColumn("[progress.description]{task.description}"),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    console = Console(stderr=True)
    with Progress(
        *columns,
        console=console,
        transient=True,
        disable=not console.is_terminal,
        redirect_stdout=False,
        redirect_stderr=False,
    ) as progress:
        task = progress.add_task("slips", total=total)
        result = measure(
            options.kind, simulate=simulate, http=http, step=lambda: progress.advance(task), only=options.only
        )
    for grid in result.grids:
        grid.print()
    if options.page:
        if not (result.whole and result.rates):
            parser.error(
                "--page needs all slips: give it without --kind, --only, --no-service and --no-simulated"
            )
        PAGE.write_text(page(result.outcomes, result.rates, UNSEEN), encoding="utf-8")
    if options.json:
        reached = {bar.promise: {"reached": bar.reached, "holds": bar.holds} for bar in result.bars}
        document = {
            "bars": reached,
            "slips": json.loads(to_json(result.outcomes)),
            "sound": json.loads(to_json(result.sound)),
        }
        options.json.write_text(json.dumps(document, indent=1) + "\n")
    return 0 if all(bar.holds for bar in result.bars) or not options.check else 1


def _in_folder(slip: Slip) -> Outcome:
    with tempfile.TemporaryDirectory() as folder:
        if slip.command == "db":
            return system.run_database(slip, Path(folder))
        return run_slip(slip, Path(folder))


def _rates(step: Step) -> tuple[Rate, ...]:
    return (
        simulated.sound_rate(progress=step),
        simulated.yaw_rate(0.3, progress=step),
        simulated.base_rate(0.01, progress=step),
    )


def _codes(rate: Rate) -> str:
    return ", ".join(f"{code} {count}" for code, count in rate.codes) or "none"


def _short(text: str) -> str:
    return text if len(text) <= 90 else text[:88] + " …"


if __name__ == "__main__":
    sys.exit(main())
