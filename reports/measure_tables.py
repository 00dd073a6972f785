"""Tables of the measures of a surgery by stage, and their cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from contract.spine import MeasureValue
from reports.measure_text import amount, interval
from spinewatch.spine.definitions import DEFINITIONS
from spinewatch.spine.results import MeasureStatus

STAGES_PER_TABLE = 5
"""Most columns of a table side by side, so that a page holds it."""


@dataclass(frozen=True)
class Cell:
    """A number of a table with everything that qualifies it.

    Attributes
    ----------
    value
        The value with its unit, or a dash.
    interval
        Its 95% interval; empty when unknown.
    mark
        What qualifies it: ``bracketed``, ``assumed``, ``not measured`` or empty.
    note
        Vertebrae where they differ from those of the row, and the reason of the mark.
    """

    value: str
    interval: str
    mark: str
    note: str


@dataclass(frozen=True)
class Row:
    """A row of a table of measures.

    Attributes
    ----------
    name
        Name of the measure.
    definition
        Identifier of its definition.
    levels
        Vertebrae that it is measured between.
    cells
        One cell a column.
    """

    name: str
    definition: str
    levels: str
    cells: tuple[Cell, ...]


@dataclass(frozen=True)
class Table:
    """A table of measures.

    Attributes
    ----------
    subject
        Name of the curve; empty for the whole spine.
    columns
        Names of the columns.
    rows
        The rows.
    """

    subject: str
    columns: tuple[str, ...]
    rows: tuple[Row, ...]


def levels_text(levels: Sequence[str]) -> str:
    """Return the names of vertebrae as a range.

    Parameters
    ----------
    levels
        Vertebrae, cranial first.

    Returns
    -------
    str
        The first and the last one.

    Examples
    --------
    >>> levels_text(["T7", "L1"]), levels_text(["T9"])
    ('T7–L1', 'T9')
    """
    return "–".join(dict.fromkeys((*levels[:1], *levels[-1:])))


def name_of(definition: str) -> str:
    """Return the name of a definition, or its identifier when the registry does not know it.

    Parameters
    ----------
    definition
        Identifier of the definition.

    Returns
    -------
    str
        The name.

    Examples
    --------
    >>> name_of("from-a-later-version")
    'from-a-later-version'
    """
    known = DEFINITIONS.get(definition)
    return definition if known is None else known.name


def row_of(measure: MeasureValue) -> tuple[str, ...]:
    """Return what the values of one row have in common.

    Parameters
    ----------
    measure
        A measure of a stage, or its change.

    Returns
    -------
    tuple of str
        The definition; for the whole spine also the vertebrae. A curve has one value of a definition, whose vertebrae
        may differ from stage to stage.
    """
    return (measure.definition, *(measure.levels if measure.curve is None else ()))


def cell(measure: MeasureValue | None, levels: Sequence[str] = (), *, signed: bool = False) -> Cell:
    """Return a measure as a cell.

    Parameters
    ----------
    measure
        The measure; None where a stage does not have it.
    levels
        Vertebrae that the row names already.
    signed
        Whether a positive value gets a plus sign.

    Returns
    -------
    Cell
        The cell; a dash with the reason when not measured.
    """
    if measure is None:
        return Cell(amount(None, ""), "", "not measured", "not reported for this stage")
    measured = measure.status is not MeasureStatus.NOT_MEASURED and measure.value is not None
    marks = (
        []
        if measure.status is MeasureStatus.MEASURED and measured
        else [measure.status.value.replace("_", " ")]
    )
    if not measured:
        marks = ["not measured"]
    elif measure.assumed:
        marks.append("assumed")
    notes = [levels_text(measure.levels)] if list(measure.levels) != list(levels) else []
    notes += [measure.reason] if measure.reason else []
    return Cell(
        amount(measure.value if measured else None, measure.unit, signed=signed),
        interval(measure.interval if measured else None, measure.unit, signed=signed),
        ", ".join(marks),
        ": ".join(notes),
    )


def measure_tables(
    columns: Sequence[tuple[str, Sequence[MeasureValue]]], *, signed: bool = False
) -> tuple[Table, ...]:
    """Return tables of measures, one per curve and group of columns; measures of single vertebrae are left out.

    Parameters
    ----------
    columns
        Name and measures of each column, for example of each stage.
    signed
        Whether positive values get a plus sign.

    Returns
    -------
    tuple of Table
        At most `STAGES_PER_TABLE` columns each, evenly divided; curves first and the whole spine last.
    """
    found: list[Table] = []
    width = -(-len(columns) // max(-(-len(columns) // STAGES_PER_TABLE), 1)) or 1
    for start in range(0, len(columns), width):
        part = [(name, [m for m in measures if not _of_vertebra(m)])
                for name, measures in columns[start : start + width]]  # fmt: skip
        curves = dict.fromkeys(measure.curve for _, measures in part for measure in measures)
        ordered = sorted(curves, key=lambda name: (name is None, name or ""))
        found += [_table(curve, part, signed=signed) for curve in ordered]
    return tuple(found)


def _of_vertebra(measure: MeasureValue) -> bool:
    return measure.curve is None and len(measure.levels) == 1


def _table(
    curve: str | None, columns: Sequence[tuple[str, Sequence[MeasureValue]]], *, signed: bool
) -> Table:
    by_column = [{row_of(m): m for m in measures if m.curve == curve} for _, measures in columns]
    rows = []
    for key in dict.fromkeys(key for found in by_column for key in found):
        first = next(found[key] for found in by_column if key in found)
        cells = tuple(cell(found.get(key), first.levels, signed=signed) for found in by_column)
        rows.append(Row(name_of(first.definition), first.definition, levels_text(first.levels), cells))
    return Table(curve or "", tuple(name for name, _ in columns), tuple(rows))
