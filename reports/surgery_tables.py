"""Tables of the report of a surgery: measures by stage, changes, attribution, vertebrae and what remains."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from contract.spine import (
    Attribution,
    MeasureValue,
    Share,
    SpineChange,
    StageSpine,
    VertebraChange,
    VertebraState,
)
from reports.measure_text import amount, interval, with_sd
from spinewatch.spine.configuration import Origin
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


@dataclass(frozen=True)
class TextTable:
    """A table of texts.

    Attributes
    ----------
    title
        Its title.
    columns
        Names of the columns.
    rows
        Texts, one a column.
    notes
        Sentences below it.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()


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
    by_column = [{m.definition: m for m in measures if m.curve == curve} for _, measures in columns]
    rows = []
    for definition in dict.fromkeys(definition for found in by_column for definition in found):
        first = next(found[definition] for found in by_column if definition in found)
        cells = tuple(cell(found.get(definition), first.levels, signed=signed) for found in by_column)
        rows.append(Row(name_of(definition), definition, levels_text(first.levels), cells))
    return Table(curve or "", tuple(name for name, _ in columns), tuple(rows))


def vertebra_table(spine: StageSpine) -> TextTable:
    """Return where each vertebra is at a stage.

    Parameters
    ----------
    spine
        The spine at the stage.

    Returns
    -------
    TextTable
        Positions and tilts with their standard deviations; a vertebra without a pose has dashes and a reason.
    """
    rows, notes = [], []
    for state in spine.vertebrae:
        numbers = _state_numbers(state)
        rows.append((state.vertebra, state.origin.value.replace("_", " "), *(with_sd(*n) for n in numbers)))
        if state.reason:
            notes.append(f"{state.vertebra}: {state.reason}")
    columns = (
        "vertebra", "pose", "anterior mm", "left mm", "cephalad mm", "coronal tilt °", "sagittal tilt °",
        "axial rotation °",
    )  # fmt: skip
    return TextTable(f"Vertebrae at {spine.stage}", columns, tuple(rows), _joined(notes))


def _state_numbers(state: VertebraState) -> list[tuple[float | None, float | None]]:
    unknown = [None] * 3
    position = zip(state.position_mm or unknown, state.position_sd_mm or unknown, strict=True)
    return [
        *position,
        (state.coronal_tilt_deg, state.coronal_tilt_sd_deg),
        (state.sagittal_tilt_deg, state.sagittal_tilt_sd_deg),
        (state.axial_rotation_deg, state.axial_rotation_sd_deg),
    ]


def motion_table(stage: str, change: SpineChange) -> TextTable:
    """Return how each vertebra moved between two stages.

    Parameters
    ----------
    stage
        Name of the later stage.
    change
        The change.

    Returns
    -------
    TextTable
        Translations and rotations with their standard deviations; a vertebra without a motion has dashes and a reason.
    """
    rows, notes = [], []
    for moved in change.vertebrae:
        numbers = _motion_numbers(moved)
        rows.append((moved.vertebra, moved.origin.value.replace("_", " "), *(with_sd(*n) for n in numbers)))
        if moved.reason:
            notes.append(f"{moved.vertebra}: {moved.reason}")
    columns = (
        "vertebra", "pose", "anterior mm", "left mm", "cephalad mm", "coronal °", "sagittal °", "derotation °",
        "angle °", "distraction mm",
    )  # fmt: skip
    return TextTable(f"{stage} since {change.since.name}", columns, tuple(rows), _joined(notes))


def _motion_numbers(moved: VertebraChange) -> list[tuple[float | None, float | None]]:
    return [
        *zip(moved.translation_mm, moved.translation_sd_mm, strict=True),
        (moved.coronal_deg, moved.coronal_sd_deg),
        (moved.sagittal_deg, moved.sagittal_sd_deg),
        (moved.derotation_deg, moved.derotation_sd_deg),
        (moved.angle_deg, moved.angle_sd_deg),
        (moved.distraction_mm, moved.distraction_sd_mm),
    ]


def _joined(notes: Iterable[str]) -> tuple[str, ...]:
    """Return notes with the vertebrae of the same reason together."""
    by_reason: dict[str, list[str]] = {}
    for note in notes:
        level, reason = note.split(": ", 1)
        by_reason.setdefault(reason, []).append(level)
    return tuple(f"{', '.join(levels)}: {reason}" for reason, levels in by_reason.items())


@dataclass(frozen=True)
class AttributionTable:
    """Attribution of a change.

    Attributes
    ----------
    title
        Both stages.
    rows
        Subject, identifier of the definition, total, parts by rotation and by distraction, remainder.
    notes
        Why there is no attribution of a subject.
    """

    title: str
    rows: tuple[tuple[str, str, Cell, Cell, Cell, str], ...]
    notes: tuple[str, ...]


def attribution_table(stage: str, change: SpineChange) -> AttributionTable:
    """Return how much of a change came with rotation and how much with distraction.

    Parameters
    ----------
    stage
        Name of the later stage.
    change
        The change.

    Returns
    -------
    AttributionTable
        One row per curve or vertebra.
    """
    rows = tuple(
        (
            part.subject,
            part.quantity,
            _share(part.total, part),
            _share(part.rotation, part),
            _share(part.distraction, part),
            amount(part.remainder, part.unit, signed=True),
        )
        for part in change.attribution
    )
    notes = _joined(f"{part.subject}: {part.reason}" for part in change.attribution if part.reason)
    return AttributionTable(f"{stage} since {change.since.name}", rows, notes)


def _share(share: Share, part: Attribution) -> Cell:
    ends = interval(share.interval, part.unit, signed=True)
    return Cell(
        amount(share.value, part.unit, signed=True),
        ends,
        "" if share.value is not None else "not measured",
        "",
    )


def remaining_table(spine: StageSpine) -> TextTable | None:
    """Return what remains to the target at a stage.

    Parameters
    ----------
    spine
        The spine at the stage.

    Returns
    -------
    TextTable or None
        One row per planned vertebra; None without a target.
    """
    if spine.remaining is None:
        return None
    rows = []
    for left in spine.remaining:
        tilts = zip((left.coronal_deg, left.sagittal_deg, left.axial_deg), left.sd_deg, strict=True)
        moves = zip(left.translation_mm, left.translation_sd_mm, strict=True)
        rows.append((left.vertebra, *(with_sd(*number) for number in (*tilts, *moves))))
    columns = (
        "vertebra", "coronal °", "sagittal °", "axial °", "anterior mm", "left mm", "cephalad mm",
    )  # fmt: skip
    planned = all(value is not None for left in spine.remaining for value in left.translation_mm)
    notes = () if planned else ("A dash in a translation: the plan has no position for this vertebra.",)
    return TextTable(f"At {spine.stage}", columns, tuple(rows), notes)


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


def not_drawn(spine: StageSpine) -> str:
    """Return which vertebrae have no pose at a stage and so are in no drawing.

    Parameters
    ----------
    spine
        The spine at the stage.

    Returns
    -------
    str
        Their names; empty when all have one.
    """
    missing = [
        s.vertebra for s in spine.vertebrae if s.origin is Origin.NOT_MEASURED or s.position_mm is None
    ]
    return ", ".join(missing)
