"""The main results of a surgery: a curve, or the whole spine, in one line each."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from contract.spine import MeasureValue, StageSpine
from reports.measure_tables import Cell, cell, levels_text, name_of, row_of
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
    start, end = (_rows(spine.measures, curve) for spine in (first, last))
    changes = {} if last.since_baseline is None else _rows(last.since_baseline.measures, curve)
    wanted = [
        key for definition in definitions for key in dict.fromkeys((*start, *end)) if key[0] == definition
    ]
    found = []
    for key in wanted:
        before, after = start.get(key), end.get(key)
        known = before or end[key]
        name = f"{name_of(known.definition)} ({levels_text(known.levels)})"
        levels = known.levels
        if last is first:
            found.append(Headline(name, known.definition, cell(before, levels), None, None))
        else:
            moved = cell(changes[key], levels, signed=True) if key in changes else _NO_CHANGE
            found.append(Headline(name, known.definition, cell(before, levels), cell(after, levels), moved))
    return tuple(found)


def _rows(measures: Sequence[MeasureValue], curve: str | None) -> dict[tuple[str, ...], MeasureValue]:
    return {row_of(measure): measure for measure in measures if measure.curve == curve}


_NO_CHANGE = Cell(amount(None, ""), "", "not measured", "no change was reported")
