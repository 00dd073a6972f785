"""Cobb angles of simulated spines without marker noise, by which vertebrae carry a marker.

The true fixed-level Cobb angle is that between the vertebrae that the value names; the true re-selected one is that of
the true curve, whose extremes of tilt are searched among all levels.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from bench.scoring import rms
from bench.spine_surgeries import BASELINE, STAGES, CartMotion, Markers, Surgery, simulated_surgery
from bench.spine_truth import coronal_tilts_deg, true_ends
from bench.tables import Bar, Grid
from spinewatch.simulation.scoliosis import LEVELS, CurveKind, ScoliosisParameters
from spinewatch.spine.measures import measure_spine
from spinewatch.spine.results import Curve, MeasureStatus, MeasureValue
from spinewatch.spine.stage_spine import spine_at_stage

THESIS_LEVELS = ("T7", "T9", "T11", "L1")
_ROUNDING = 1e-6
"""An interval of an exact value may miss the truth by rounding, degrees."""

EVERY_SECOND = LEVELS[::2]
DEFINITIONS = ("cobb-fixed", "cobb-reselected")
MOVED = "re-selected, without a marker on its ends"
_GROUPS = (*DEFINITIONS, MOVED)
_ENDS = "end vertebrae and apices"
_AND_L5 = "the same and L5"
_SECOND = "every second level"
_THESIS = "T7 T9 T11 L1"
_SHORT = ScoliosisParameters(
    cobb_deg=(20.0, 60.0), thoracic_upper=("T7", "T8"), thoracic_lower=("T12", "L1"), compensation=(0.3, 0.5)
)
"""Thoracic curves within the levels that the thesis marked."""


@dataclass
class CobbErrors:
    """Errors of the Cobb angles of one kind of spine with one set of markers.

    Attributes
    ----------
    name
        The spines.
    markers
        Which vertebrae carry one.
    initial
        Which vertebrae have an initial pose.
    errors_deg
        Errors by definition, degrees; re-selected angles are apart where a true end vertebra of the stage is not
        marked.
    inside
        Whether the truth lies in the reported interval, for bracketed fixed-level values and for re-selected ones.
    beyond
        Number of true end vertebrae pairs of the stage that reach beyond the marked span, so that no re-selected angle
        can be right.
    open_ends
        Number of curves that the library says may go on beyond the marked span.
    status
        Number of values by definition and status; ``no curve`` where the library reports none near the true one.
    """

    name: str
    markers: str
    initial: str
    errors_deg: dict[str, list[float]] = field(default_factory=lambda: {d: [] for d in _GROUPS})
    inside: dict[str, list[bool]] = field(default_factory=lambda: {d: [] for d in DEFINITIONS})
    beyond: int = 0
    open_ends: int = 0
    status: Counter[tuple[str, str]] = field(default_factory=Counter)

    def bias(self, definition: str) -> float:
        """Return the mean error, degrees."""
        return float(np.mean(self.errors_deg[definition])) if self.errors_deg[definition] else float("nan")

    def rms(self, definition: str) -> float:
        """Return the RMS error, degrees."""
        return rms(self.errors_deg[definition]) if self.errors_deg[definition] else float("nan")

    def inside_pct(self, definition: str) -> float:
        """Return the percentage of intervals that hold the truth."""
        return 100 * float(np.mean(self.inside[definition])) if self.inside[definition] else float("nan")


def cobb_errors(count: int) -> tuple[CobbErrors, ...]:
    """Return the errors of ``count`` spines of each kind."""
    found = []
    for number, kind in enumerate(CurveKind):
        for markers in (_ENDS, _AND_L5, _SECOND):
            for initial in ("all levels", "marked levels"):
                tally = CobbErrors(kind.value, markers, initial)
                for seed in range(count):
                    rng = np.random.default_rng([12, 2, number, seed])
                    surgery = _surgery(rng, kind, markers)
                    _count(tally, surgery, initial)
                found.append(tally)
    for name, ranges in (("thoracic within T7-L1", _SHORT), ("thoracic", None)):
        for initial in ("all levels", "marked levels"):
            tally = CobbErrors(name, _THESIS, initial)
            for seed in range(count):
                rng = np.random.default_rng([12, 3, seed])
                _count(
                    tally,
                    simulated_surgery(rng, CurveKind.THORACIC, marked=THESIS_LEVELS, parameters=ranges),
                    initial,
                )
            found.append(tally)
    return tuple(found)


def grids_and_bars(found: Sequence[CobbErrors]) -> tuple[list[Grid], tuple[Bar, ...]]:
    """Return the table of Cobb errors and its bars."""
    rows = (
        (
            t.name,
            t.markers,
            t.initial,
            *(_figures(t, group) for group in _GROUPS),
            ", ".join(f"{status} {count}" for status, count in sorted(_by_status(t, DEFINITIONS[0]).items())),
            *(f"{t.inside_pct(d):.1f}" if t.inside[d] else "-" for d in DEFINITIONS),
            f"{t.beyond} {t.open_ends}",
        )
        for t in found
    )
    columns = [
        "curves",
        "markers on",
        "initial poses",
        "fixed: bias RMS (n)",
        "re-selected",
        "the same, ends not marked",
        "fixed: status",
        "bracketed: truth inside %",
        "re-selected: inside %",
        "beyond the markers, open ends",
    ]
    title = "Cobb angle without marker noise, degrees"
    return [Grid.of(title, columns, rows)], tuple(_bars(found))


def _bars(found: Sequence[CobbErrors]) -> list[Bar]:
    ends = [t for t in found if t.markers == _ENDS]
    second = [t for t in found if t.markers == _SECOND]
    thesis = [t for t in found if t.markers == _THESIS]
    bias = max(abs(t.bias(d)) for t in ends for d in DEFINITIONS if t.errors_deg[d])
    worst = max(t.rms(d) for t in ends for d in DEFINITIONS if t.errors_deg[d])
    spaced, worst_kind = _spaced_rms(second)
    bracketed = [_by_status(t, DEFINITIONS[0])[MeasureStatus.BRACKETED.value] for t in thesis]
    measured = sum(_by_status(t, DEFINITIONS[0])[MeasureStatus.MEASURED.value] for t in thesis)
    inside = [t.inside_pct(DEFINITIONS[0]) for t in thesis if t.inside[DEFINITIONS[0]]]
    outside = sum(_by_status(t, DEFINITIONS[0])[MeasureStatus.NOT_MEASURED.value] for t in thesis)
    open_ends = sum(t.open_ends for t in thesis)
    return [
        Bar("Cobb, end vertebrae marked: bias < 0.3 deg", f"{bias:.2f}", bias < 0.3),
        Bar("and RMS <= 0.8 deg", f"{worst:.2f}", worst <= 0.8),
        Bar(
            "Cobb, every second level marked, over all spines: RMS <= 1.7 deg",
            f"{spaced:.2f}; of one kind of curve up to {worst_kind:.2f}",
            spaced <= 1.7,
        ),
        Bar(
            f"Cobb, {_THESIS} marked: bracketed unless both ends are marked",
            f"{sum(bracketed)} bracketed, {measured} with both ends marked; {open_ends} with an open end,"
            f" {outside} not measured",
            sum(bracketed) > 0,
        ),
        Bar(
            "and the truth inside in >= 95%",
            ", ".join(f"{share:.1f}%" for share in inside),
            all(share >= 95 for share in inside),
        ),
    ]


def _spaced_rms(tallies: Sequence[CobbErrors]) -> tuple[float, float]:
    """Return the greatest RMS error by definition and initial poses: over all spines, and over one kind of them."""
    pooled: dict[tuple[str, str], list[float]] = defaultdict(list)
    by_kind = []
    for tally in tallies:
        for definition, groups in (
            (DEFINITIONS[0], DEFINITIONS[:1]),
            (DEFINITIONS[1], (DEFINITIONS[1], MOVED)),
        ):
            errors = [error for group in groups for error in tally.errors_deg[group]]
            pooled[definition, tally.initial] += errors
            by_kind.append(rms(errors))
    return max(rms(errors) for errors in pooled.values()), max(by_kind)


def nearest_curve(curves: Sequence[Curve], upper: int, lower: int) -> Curve | None:
    """Return the curve that overlaps the levels most; None if none overlaps half of them."""
    best, overlap = None, 0.5
    for curve in curves:
        a, b = LEVELS.index(curve.upper), LEVELS.index(curve.lower)
        shared = (min(b, lower) - max(a, upper)) / (max(b, lower) - min(a, upper))
        if shared > overlap:
            best, overlap = curve, shared
    return best


def _surgery(rng: np.random.Generator, kind: CurveKind, markers: str) -> Surgery:
    if markers == _SECOND:
        return simulated_surgery(rng, kind, marked=EVERY_SECOND, cart=CartMotion())
    which: Markers = "ends and apices" if markers == _ENDS else "ends, apices and L5"
    return simulated_surgery(rng, kind, which, cart=CartMotion())


def _count(tally: CobbErrors, surgery: Surgery, initial: str) -> None:
    setup = surgery.exact_setup(LEVELS if initial == "all levels" else surgery.marked)
    stage = STAGES[-1]
    baseline = spine_at_stage(setup, surgery.triads, BASELINE)
    spine = spine_at_stage(setup, surgery.triads, stage)
    measured = measure_spine(spine, baseline)
    after = coronal_tilts_deg(surgery.truth(stage))
    near = surgery.spines[BASELINE].ends
    ends = true_ends(surgery.truth(BASELINE), near)
    at_stage = true_ends(surgery.truth(stage), near)
    for number in range(len(ends) - 1):
        curve = nearest_curve(measured.curves, ends[number], ends[number + 1])
        tally.open_ends += bool(curve is not None and curve.open_ends)
        true_levels = {DEFINITIONS[1]: (LEVELS[at_stage[number]], LEVELS[at_stage[number + 1]])}
        for definition in DEFINITIONS:
            value = _value(measured.measures, definition, curve)
            if value is None:
                tally.status[definition, "no curve"] += 1
                continue
            tally.status[definition, value.status.value] += 1
            if value.status is MeasureStatus.NOT_MEASURED:
                continue
            upper, lower = true_levels.get(definition, (value.levels[0], value.levels[-1]))
            truth = float(after[LEVELS.index(lower)] - after[LEVELS.index(upper)])
            if definition == DEFINITIONS[1] and _beyond(surgery, upper, lower):
                tally.beyond += 1
                continue
            marked = {upper, lower} <= set(surgery.marked)
            group = MOVED if definition == DEFINITIONS[1] and not marked else definition
            tally.errors_deg[group].append(value.value - truth)
            if value.status is MeasureStatus.BRACKETED:
                tally.inside[definition].append(
                    bool(value.lower - _ROUNDING <= truth <= value.upper + _ROUNDING)
                )


def _beyond(surgery: Surgery, upper: str, lower: str) -> bool:
    """Return whether an end vertebra lies outside the marked span."""
    return LEVELS.index(upper) < LEVELS.index(surgery.marked[0]) or LEVELS.index(lower) > LEVELS.index(
        surgery.marked[-1]
    )


def _value(measures: Sequence[MeasureValue], definition: str, curve: Curve | None) -> MeasureValue | None:
    if curve is None:
        return None
    found = [m for m in measures if m.definition == definition and m.curve == curve.name]
    return found[0] if found else None


def _figures(tally: CobbErrors, group: str) -> str:
    errors = tally.errors_deg[group]
    return f"{tally.bias(group):+.2f} {tally.rms(group):.2f} ({len(errors)})" if errors else "-"


def _by_status(tally: CobbErrors, definition: str) -> Counter[str]:
    return Counter({status: count for (d, status), count in tally.status.items() if d == definition})
