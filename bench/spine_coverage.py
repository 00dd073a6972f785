"""95% intervals of measures, changes, motions and attribution over simulated surgeries with the rig's noise."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from bench.scoring import rms
from bench.spine_surgeries import (
    BASELINE,
    INTER,
    POST,
    STAGES,
    CartMotion,
    Surgery,
    measured_stages,
    simulated_surgery,
)
from bench.spine_truth import difference, true_reselected, true_value
from bench.tables import Bar, Grid
from spinewatch.simulation.scoliosis import CurveKind
from spinewatch.spine.attribution import attribute
from spinewatch.spine.changes import vertebra_changes
from spinewatch.spine.comparison import compare_stages
from spinewatch.spine.configuration import SpineConfiguration, SpineSetup
from spinewatch.spine.definitions import DEFINITIONS
from spinewatch.spine.measures import measure_spine
from spinewatch.spine.results import Attribution, Curve, MeasureStatus, MeasureValue, VertebraChange
from spinewatch.spine.stage_spine import spine_at_stage
from spinewatch.triads.pose import Pose

INITIAL_SD = (1.0, 1.5)
"""Deviations of the typed initial poses per axis, mm and degrees."""

MARKED_TOO = ("T1", "T2", "T5", "T10", "T12", "L1", "L2", "L5")
"""Levels that carry a marker beside end vertebrae and apices, so that every measure is measured."""

RESELECTED = "cobb-reselected"


@dataclass
class Tally:
    """Reported values of one kind: errors, stated deviations, and whether the interval holds the truth."""

    errors: list[float] = field(default_factory=list)
    sd: list[float] = field(default_factory=list)
    inside: list[bool] = field(default_factory=list)

    def add(self, error: float, sd: float, *, inside: bool) -> None:
        """Add a value."""
        self.errors.append(error)
        self.sd.append(sd)
        self.inside.append(inside)

    @property
    def inside_pct(self) -> float:
        """Percentage of intervals that hold the truth."""
        return 100 * float(np.mean(self.inside)) if self.inside else float("nan")


@dataclass
class Coverage:
    """Tallies by kind of value, and how many surgeries and values there were.

    Keys are (when, name, status): when is ``stage`` or ``change``, name is that of the definition, motion or part.
    """

    surgeries: int = 0
    tallies: dict[tuple[str, str, str], Tally] = field(default_factory=lambda: defaultdict(Tally))
    not_measured: dict[tuple[str, str], int] = field(default_factory=lambda: defaultdict(int))


Frame = Literal["object", "patient"]


def coverage(
    count: int, at_once: int = 60, *, axes_sd_deg: float = 0.0, frames: Sequence[Frame] = ("object",)
) -> Coverage:
    """Return the coverage over ``count`` surgeries, whose initial poses are given in each frame in turn.

    The patient axes of a setup err by ``axes_sd_deg`` (sd) about each of them, which the setup states.
    """
    found = Coverage()
    kinds = list(CurveKind)
    for first in range(0, count, at_once):
        rng = np.random.default_rng([12, 5, first])
        surgeries = [
            simulated_surgery(rng, kinds[i % len(kinds)], extra=MARKED_TOO, cart=CartMotion())
            for i in range(first, min(first + at_once, count))
        ]
        measured = measured_stages(surgeries, rng)
        for number, (surgery, stages) in enumerate(zip(surgeries, measured, strict=True)):
            if any(surgery.reference not in stages[stage] for stage in STAGES):
                continue
            frame = frames[number % len(frames)]
            _count(found, surgery, stages, surgery.uncertain_setup(rng, *INITIAL_SD, axes_sd_deg, frame))
    return found


def grids_and_bars(found: Coverage) -> tuple[list[Grid], tuple[Bar, ...]]:
    """Return the tables of coverage and their bars."""
    rows = [
        (
            when,
            name,
            status,
            len(tally.inside),
            f"{rms(tally.errors):.2f}",
            f"{rms(tally.sd):.2f}",
            f"{np.mean(tally.errors):+.2f}",
            f"{tally.inside_pct:.1f}",
        )
        for (when, name, status), tally in sorted(found.tallies.items())
    ]
    columns = ["", "of", "status", "n", "RMS error", "stated sd", "bias", "inside 95% interval, %"]
    title = f"95% intervals over {found.surgeries} simulated surgeries with the rig's noise, deg and mm"
    return [Grid.of(title, columns, rows)], tuple(_bars(found))


def _bars(found: Coverage) -> Iterator[Bar]:
    measured = {
        (when, name): tally
        for (when, name, status), tally in found.tallies.items()
        if status == MeasureStatus.MEASURED.value
    }
    for when in ("baseline", "stage", "change"):
        by_name = {name: tally for (w, name), tally in measured.items() if w == when and name in DEFINITIONS}
        yield _bar(f"every measure, {when}", by_name)
    yield _bar("every part of a motion", {name: t for (w, name), t in measured.items() if w == "motion"})
    yield _bar(
        "every part of the attribution", {name: t for (w, name), t in measured.items() if w == "attribution"}
    )
    absolute, change = (measured.get((when, "cobb-fixed"), Tally()) for when in ("stage", "change"))
    smaller = rms(change.sd) < rms(absolute.sd) and rms(change.errors) < rms(absolute.errors)
    yield Bar(
        "change of Cobb has a smaller deviation than Cobb itself",
        f"{rms(change.sd):.2f} and {rms(absolute.sd):.2f} deg",
        smaller,
    )


def _bar(of: str, tallies: Mapping[str, Tally]) -> Bar:
    shares = {name: tally.inside_pct for name, tally in tallies.items()}
    if not shares:
        return Bar(f"95% intervals hold 93-97%, {of}", "nothing measured", holds=False)
    low, high = min(shares, key=shares.__getitem__), max(shares, key=shares.__getitem__)
    reached = f"{shares[low]:.1f}% ({low}) to {shares[high]:.1f}% ({high})"
    return Bar(f"95% intervals hold 93-97%, {of}", reached, all(93 <= s <= 97 for s in shares.values()))


def _count(
    found: Coverage, surgery: Surgery, stages: Mapping[str, Mapping[str, Pose]], setup: SpineSetup
) -> None:
    found.surgeries += 1
    spines = {stage: spine_at_stage(setup, stages, stage) for stage in STAGES}
    baseline = spines[BASELINE]
    true = {
        stage: replace(surgery.true_configuration(stage), marked=spine.marked)
        for stage, spine in spines.items()
    }
    measured = {stage: measure_spine(spine, baseline) for stage, spine in spines.items()}
    curves = measured[BASELINE].curves
    for value in measured[POST].measures:
        _count_measure(found, "stage", value, curves, surgery, (POST,))
    for value in measured[BASELINE].measures:
        _count_measure(found, "baseline", value, curves, surgery, (BASELINE,))
    for before, after in ((BASELINE, POST), (INTER, POST)):
        change = compare_stages(spines[before], spines[after], baseline, surgery.reference)
        for value in change.measures:
            _count_measure(found, "change", value, curves, surgery, (after, before))
        known = vertebra_changes(true[before], true[after], surgery.reference)
        for vertebra, truth in zip(change.vertebrae, known, strict=True):
            _count_motion(found, vertebra, truth, surgery)
        parts = attribute(true[before], true[after], baseline, surgery.reference)
        for part, truth_part in zip(change.attribution, parts, strict=True):
            _count_attribution(found, part, truth_part, spines[after], curves)


def _count_measure(
    found: Coverage,
    when: str,
    value: MeasureValue,
    curves: Sequence[Curve],
    surgery: Surgery,
    stages: Sequence[str],
) -> None:
    if value.status is MeasureStatus.NOT_MEASURED:
        found.not_measured[when, value.definition] += 1
        return
    true = [_truth(value, curves, surgery, stage) for stage in stages]
    truth = true[0] if len(true) == 1 else difference(value.definition, true[0], true[1])
    error = difference(value.definition, value.value, truth)
    low = difference(value.definition, truth, value.lower)
    inside = 0 <= low <= value.upper - value.lower
    found.tallies[when, value.definition, value.status.value].add(error, value.sd, inside=inside)


def _truth(value: MeasureValue, curves: Sequence[Curve], surgery: Surgery, stage: str) -> float:
    poses = surgery.truth(stage)
    if value.definition == RESELECTED and value.curve is not None:
        return true_reselected(poses, curves, value.curve)
    return true_value(value.definition, value.levels, poses)


def _count_motion(found: Coverage, change: VertebraChange, truth: VertebraChange, surgery: Surgery) -> None:
    if change.reason is not None or change.vertebra == surgery.reference:
        return
    status = change.origin.value
    values = [
        *zip(
            ("x mm", "y mm", "z mm"),
            change.translation_mm,
            truth.translation_mm,
            change.translation_sd_mm,
            strict=True,
        ),
        *zip(
            ("about x", "about y", "about z"),
            change.rotation_vector_deg,
            truth.rotation_vector_deg,
            change.rotation_sd_deg,
            strict=True,
        ),
        ("derotation", change.derotation_deg, truth.derotation_deg, change.derotation_sd_deg),
        ("coronal tilt", change.coronal_deg, truth.coronal_deg, change.coronal_sd_deg),
        ("sagittal tilt", change.sagittal_deg, truth.sagittal_deg, change.sagittal_sd_deg),
        ("distraction mm", change.distraction_mm, truth.distraction_mm, change.distraction_sd_mm),
    ]
    for name, value, true, sd in values:
        error = float(value - true)
        found.tallies["motion", name, status].add(error, float(sd), inside=abs(error) <= 1.96 * sd)


def _count_attribution(
    found: Coverage, part: Attribution, truth: Attribution, after: SpineConfiguration, curves: Sequence[Curve]
) -> None:
    if np.isnan([part.rotation.value, truth.rotation.value]).any():
        found.not_measured["attribution", part.quantity] += 1
        return
    levels: tuple[str, ...] = (part.subject,)
    for curve in curves:
        if curve.name == part.subject:
            levels = (curve.upper, curve.lower)
            if part.quantity == "apical-translation" and curve.apex is not None:
                levels = (curve.apex,)
    measured = all(after.marked[after.index(level)] for level in levels)
    status = (MeasureStatus.MEASURED if measured else MeasureStatus.BRACKETED).value
    parts = ("total", "rotation", "distraction")
    for name in (*parts, "remainder") if part.quantity == "cobb-fixed" else parts:
        share, true = getattr(part, name), getattr(truth, name)
        inside = share.lower <= true.value <= share.upper
        tally = found.tallies["attribution", f"{part.quantity}: {name}", status]
        tally.add(share.value - true.value, share.sd, inside=inside)
