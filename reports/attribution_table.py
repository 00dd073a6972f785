"""The table of how much of a change came with rotation and how much with distraction."""

from __future__ import annotations

from dataclasses import dataclass

from contract.spine import Attribution, Share, SpineChange
from reports.measure_tables import Cell
from reports.measure_text import amount, interval
from reports.vertebra_tables import notes_by_reason
from spinewatch.spine.results import MeasureStatus


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
        Why the change of a subject is bracketed, or not measured.
    """

    title: str
    rows: tuple[tuple[str, str, Cell, Cell, Cell, Cell], ...]
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
            _share(part.remainder_share, part),
        )
        for part in change.attribution
    )
    notes = notes_by_reason(f"{part.subject}: {part.reason}" for part in change.attribution if part.reason)
    return AttributionTable(f"{stage} since {change.since.name}", rows, notes)


def _share(share: Share, part: Attribution) -> Cell:
    ends = interval(share.interval, part.unit, signed=True)
    return Cell(amount(share.value, part.unit, signed=True), ends, _mark(share, part), "")


def _mark(share: Share, part: Attribution) -> str:
    if share.value is None:
        return "not measured"
    marks = ["bracketed"] if part.status is MeasureStatus.BRACKETED else []
    return ", ".join([*marks, "assumed"] if part.assumed else marks)
