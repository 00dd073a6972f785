"""The report of a surgery: what the spine was before and is now, on one page that needs no other file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from contract.spine import Curve, MeasureValue, SpineChange, StageSpine
from contract.summary import SummaryStage, SurgerySummary
from reports.attribution_table import attribution_table
from reports.headlines import Headline, headlines
from reports.measure_tables import measure_tables
from reports.rendering import render
from reports.spine_drawing import Drawing, Side, draw
from reports.vertebra_tables import motion_table, not_drawn, remaining_table, vertebra_table
from spinewatch.flags import FLAGS
from spinewatch.spine.definitions import DEFINITIONS, MeasureDefinition

_OF_CURVES = ("cobb-fixed", "cobb-reselected", "apical-rotation", "apical-translation")
_OF_SPINE = ("kyphosis", "lordosis", "coronal-balance")
_TIME = "%Y-%m-%d %H:%M:%S UTC"
_LONGEST_VALUE = 60


@dataclass(frozen=True)
class CurveHeadlines:
    """The main results of a curve.

    Attributes
    ----------
    title
        Name of the curve, its side and its vertebrae; or that it is the whole spine.
    note
        What limits the curve; empty for nothing.
    rows
        The results.
    """

    title: str
    note: str
    rows: tuple[Headline, ...]


@dataclass(frozen=True)
class RaisedFlag:
    """A flag with what to do about it.

    Attributes
    ----------
    stage
        Stage that it was raised for.
    code
        Code of the flag.
    detail
        Sentence with the numbers that raised it.
    action
        What to do; empty for a flag that this version does not know.
    """

    stage: str
    code: str
    detail: str
    action: str


def render_surgery(summary: SurgerySummary) -> str:
    """Return the report of a surgery.

    Parameters
    ----------
    summary
        The surgery with all its stages.

    Returns
    -------
    str
        One HTML page that refers to no other file. The same summary gives the same page.
    """
    spines = [stage.spine for stage in summary.stages if stage.spine is not None]
    shown = _baseline_and_last(spines)
    last = shown[-1] if shown else None
    changes = _changes(spines)
    target = None if last is None else last.target_measures
    return render(
        "surgery.html",
        summary=summary,
        shown=shown,
        last=last,
        curves=_curves(shown),
        drawings=_drawings(shown),
        not_drawn=[(spine.stage, missing) for spine in shown if (missing := not_drawn(spine))],
        measures=measure_tables([(spine.stage, spine.measures) for spine in spines]),
        changes=measure_tables(
            [(_title(stage, change), change.measures) for stage, change in changes], signed=True
        ),
        attribution=[attribution_table(stage, change) for stage, change in changes],
        motions=[motion_table(stage, change) for stage, change in changes],
        vertebrae=[vertebra_table(spine) for spine in shown],
        remaining=None if last is None else remaining_table(last),
        target_measures=measure_tables([(last.stage, target)], signed=True)
        if last is not None and target
        else (),
        flags=_flags(summary.stages),
        definitions=_definitions(spines),
        parameters=[] if last is None else sorted(_flat(last.parameters)),
        time=_TIME,
    )


def _baseline_and_last(spines: Sequence[StageSpine]) -> list[StageSpine]:
    """Return the spine at the baseline stage, if there is one, and the last spine; just one if they are the same."""
    if not spines:
        return []
    last = spines[-1]
    baseline = [spine for spine in spines if spine.stage == last.baseline.name]
    return [last] if not baseline or baseline[0] is last else [baseline[0], last]


def _changes(spines: Sequence[StageSpine]) -> list[tuple[str, SpineChange]]:
    """Return the whole change up to the last stage, then that of each manoeuvre, each named by its later stage."""
    found = []
    if spines and spines[-1].since_baseline is not None:
        found.append((spines[-1].stage, spines[-1].since_baseline))
    found += [(spine.stage, spine.since_previous) for spine in spines if spine.since_previous is not None]
    distinct = {_title(stage, change): (stage, change) for stage, change in found}
    return list(distinct.values())


def _title(stage: str, change: SpineChange) -> str:
    return f"{stage} since {change.since.name}"


def _curves(shown: Sequence[StageSpine]) -> list[CurveHeadlines]:
    if not shown:
        return []
    first, last = shown[0], shown[-1]
    found = [
        CurveHeadlines(
            f"{curve.name}: {curve.upper}–{curve.lower}, {_form(curve)}",
            _open_ends(curve),
            headlines(first, last, curve.name, _OF_CURVES),
        )
        for curve in first.curves
    ]
    whole = headlines(first, last, None, _OF_SPINE)
    return [*found, CurveHeadlines("Whole spine", "", whole)] if whole else found


def _form(curve: Curve) -> str:
    apex = "no vertebra between them" if curve.apex is None else f"apex {curve.apex}"
    side = "side of the convexity not known" if curve.side is None else f"convex to the {curve.side}"
    return f"{apex}, {side}"


def _open_ends(curve: Curve) -> str:
    if not curve.open_ends:
        return ""
    return f"{' and '.join(curve.open_ends)} is the end of the measured span: the curve may go on beyond it."


def _drawings(shown: Sequence[StageSpine]) -> list[Drawing]:
    if not shown:
        return []
    return [drawing for side in Side if (drawing := draw(shown, side)) is not None]


def _flags(stages: Sequence[SummaryStage]) -> list[RaisedFlag]:
    found = []
    for stage in stages:
        for flag in (*(stage.flags or ()), *(stage.spine.flags if stage.spine is not None else ())):
            kind = FLAGS.get(flag.code)
            found.append(RaisedFlag(stage.name, flag.code, flag.detail, "" if kind is None else kind.action))
    return found


def _definitions(spines: Sequence[StageSpine]) -> list[tuple[str, MeasureDefinition | None]]:
    """Return the definitions that the report uses, None for one that the registry does not know."""
    used: list[str] = []
    for spine in spines:
        values: list[MeasureValue] = [*spine.measures, *(spine.target_measures or ())]
        for change in (spine.since_baseline, spine.since_previous):
            if change is not None:
                values += change.measures
                used += [part.quantity for part in change.attribution]
        used += [value.definition for value in values]
    return [(identifier, DEFINITIONS.get(identifier)) for identifier in sorted(set(used))]


def _flat(parameters: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield parameters by dotted name; long values are cut, for the full ones are in the stored result."""
    for name, value in parameters.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            text = str(value)
            yield f"{prefix}{name}", text if len(text) <= _LONGEST_VALUE else f"{text[: _LONGEST_VALUE - 1]}…"
