"""Tables of the spine: measures at each stage with 95% intervals, and their change since the baseline stage."""

from __future__ import annotations

from collections.abc import Sequence

from commands.shared.surgery_tables import new_table, print_note, print_table
from contract.spine import MeasureValue, StageSpine

MAIN = ("cobb-fixed", "apical-rotation")
"""Measures that are printed of the sample surgery."""

_UNITS = {"deg": "°", "mm": " mm"}
_LOG_WIDTH = 130


def print_measures(spines: Sequence[StageSpine], definitions: Sequence[str] | None = None) -> None:
    """Print the measures of each stage and their change since the baseline; all of them without ``definitions``."""
    if not spines:
        return
    columns = ["", "", "", "value [95%]", "", "change [95%]", ""]
    table = new_table(f"Measures of the spine, and their change since {spines[0].baseline.name}", columns)
    for spine in spines:
        changes = [] if spine.since_baseline is None else spine.since_baseline.measures
        for measure in spine.measures:
            if definitions is not None and measure.definition not in definitions:
                continue
            change = next((item for item in changes if _same(item, measure)), None)
            levels = "-".join(measure.levels)
            table.add_row(spine.stage, _name(measure), levels, *_cells(measure), *_cells(change))
        table.add_section()
    print_table(table, _LOG_WIDTH)
    note = f"in {spines[0].frame}"
    if any(measure.assumed for spine in spines for measure in spine.measures):
        note += "; * assumed: it depends on a generic spine as the initial configuration"
    print_note(f"{note}\n")


def _same(change: MeasureValue, measure: MeasureValue) -> bool:
    return (change.definition, change.curve) == (measure.definition, measure.curve) and (
        change.curve is not None or change.levels == measure.levels
    )


def _name(measure: MeasureValue) -> str:
    return measure.definition if measure.curve is None else f"{measure.definition}, {measure.curve}"


def _cells(measure: MeasureValue | None) -> tuple[str, str]:
    """Return a value with its interval, and its status; nothing at the baseline, which has no change."""
    if measure is None:
        return "", ""
    status = measure.status.value.replace("_", " ")
    if measure.value is None or measure.interval is None:
        return "-", status
    lower, upper = measure.interval
    value = f"{measure.value:.1f}{_UNITS[measure.unit]} [{lower:.1f}, {upper:.1f}]"
    return value, f"{status}*" if measure.assumed else status
