"""The main results of a surgery: a curve, or the whole spine, in one line each."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from contract.spine import MeasureValue, StageSpine
from reports.measure_tables import Cell, cell, levels_text, name_of
from reports.measure_text import amount


@dataclass(frozen=True)
class Headline:
    """The main result of a curve, or of the whole spine, in one line.

    Attributes
    ----------
    name
        Name of the quantity.
    definition
        Identifier of its definition.
    before, after, change
        The value at the baseline, at the last stage, and its change; ``after`` and ``change`` are None when the
        baseline is the only stage.
    """

    name: str
    definition: str
    before: Cell
    after: Cell | None
    change: Cell | None


def headlines(
    first: StageSpine, last: StageSpine, curve: str | None, definitions: Iterable[str]
) -> tuple[Headline, ...]:
    """Return the main results of a curve.

    Parameters
    ----------
    first
        The spine at the baseline stage.
    last
        The spine at the last stage; the same object when there is only one.
    curve
        Name of the curve; None for measures of the whole spine.
    definitions
        Identifiers of the definitions to give.

    Returns
    -------
    tuple of Headline
        Those that the baseline or the last stage has.
    """
    found = []
    for definition in definitions:
        before, after = _find(first.measures, curve, definition), _find(last.measures, curve, definition)
        known = before or after
        if known is None:
            continue
        change = (
            None if last.since_baseline is None else _find(last.since_baseline.measures, curve, definition)
        )
        name = f"{name_of(definition)} ({levels_text(known.levels)})"
        levels = known.levels
        if last is first:
            found.append(Headline(name, definition, cell(before, levels), None, None))
        else:
            moved = cell(change, levels, signed=True) if change else _NO_CHANGE
            found.append(Headline(name, definition, cell(before, levels), cell(after, levels), moved))
    return tuple(found)


def _find(measures: Sequence[MeasureValue], curve: str | None, definition: str) -> MeasureValue | None:
    return next((m for m in measures if m.curve == curve and m.definition == definition), None)


_NO_CHANGE = Cell(amount(None, ""), "", "not measured", "no change was reported")
