"""CSV tables of a surgery: one file a kind of row in a ZIP archive, one row a stage and what the table is about.

Every header names the unit. Axes are the spine's frame: x anterior, y left, z cephalad. An empty cell is a number that
was not measured; the column ``reason`` says why. Measures carry the identifier of their definition, and
``definitions.csv`` says what each means. Text that a spreadsheet would take for a formula begins with an apostrophe.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence

from contract.spine import MeasureValue, Share, SpineChange, StageSpine, VertebraState
from contract.summary import SurgerySummary
from contract.triad import Triad
from exports.archive import zip_archive
from exports.csv_table import Cell, csv_table
from exports.definitions import definition_table, definitions_of
from exports.entries import angle_interval
from exports.open_ends import open_ends
from exports.selection import selected_spines, selected_stages
from spinewatch.errors import SpinewatchError

MEDIA_TYPE = "application/zip"
FILE_SUFFIX = ".csv.zip"
TABLES = (
    "stages", "vertebrae", "curves", "motion", "measures", "attribution", "remaining", "triads", "flags", "definitions"
)  # fmt: skip

_AXES = ("x_anterior", "y_left", "z_cephalad")
_OBJECT_AXES = ("x", "y", "z")
_UNITS = ("deg", "mm")
_STATISTICS = ("", "_sd", "_lower95", "_upper95")

Row = list[Cell]


class UnknownUnitError(SpinewatchError):
    """A measure has a unit that the tables have no column for."""

    code = "unknown-unit"


def export(summary: SurgerySummary, stage: str | None = None) -> bytes:
    """Return all tables of a surgery.

    Parameters
    ----------
    summary
        The surgery with all its stages.
    stage
        Name of one stage; None for all.

    Returns
    -------
    bytes
        ZIP archive of CSV files, named by their table.

    Raises
    ------
    UnknownStageError
        If the surgery has no stage of that name.
    UnknownUnitError
        If a measure has a unit other than mm and degrees.
    """
    return zip_archive({f"{name}.csv": table(summary, name, stage) for name in TABLES})


def table(summary: SurgerySummary, name: str, stage: str | None = None) -> bytes:
    """Return one table of a surgery.

    Parameters
    ----------
    summary
        The surgery with all its stages.
    name
        One of `TABLES`.
    stage
        Name of one stage; None for all.

    Returns
    -------
    bytes
        CSV, UTF-8.

    Raises
    ------
    UnknownStageError
        If the surgery has no stage of that name.
    KeyError
        If there is no such table.
    UnknownUnitError
        If a measure has a unit other than mm and degrees.
    """
    header, rows = _WRITERS[name]
    return csv_table(header, rows(summary, stage))


def _axis_columns(name: str, unit: str, axes: Sequence[str] = _AXES) -> list[str]:
    return [f"{name}_{axis}_{unit}" for axis in axes]


def _end_columns(name: str, unit: str) -> list[str]:
    return [f"{name}_{end}95_{unit}" for end in ("lower", "upper")]


def _value_columns(name: str) -> list[str]:
    return [f"{name}{statistic}_{unit}" for unit in _UNITS for statistic in _STATISTICS]


def _in_unit(unit: str, numbers: Sequence[Cell]) -> Row:
    """Return numbers in the columns of their unit, the other columns empty."""
    if unit not in _UNITS:
        raise UnknownUnitError(f"the tables have no column for the unit {unit!r}; export JSON instead")
    return [number if unit == column else None for column in _UNITS for number in numbers]


def _vector(values: Sequence[float | None] | None) -> Row:
    return [None, None, None] if values is None else list(values)


def _interval(ends: Sequence[float | None] | None) -> Row:
    return [None, None] if ends is None else list(ends)


def _stage_rows(summary: SurgerySummary, stage: str | None) -> Iterator[Row]:
    for found in selected_stages(summary, stage):
        yield [
            summary.surgery_id, summary.reference, found.name, found.take, found.state.value,
            None if found.captured_at is None else found.captured_at.isoformat(), found.created_at.isoformat(),
            found.calibration_id, found.images.left.sha256, found.images.right.sha256, *_spine_cells(found.spine),
            found.spine_reason, found.version,
        ]  # fmt: skip


def _spine_cells(spine: StageSpine | None) -> Row:
    if spine is None:
        return [None] * 5
    return [
        spine.frame, spine.reference_vertebra, spine.reference_line, spine.initial.value, spine.baseline.name
    ]  # fmt: skip


def _vertebra_rows(summary: SurgerySummary, stage: str | None) -> Iterator[Row]:
    for spine in selected_spines(summary, stage):
        for state in spine.vertebrae:
            rotation = (
                [None] * 9 if state.rotation is None else [number for row in state.rotation for number in row]
            )
            yield [
                spine.stage, spine.take, state.vertebra, state.origin.value, state.marked,
                *_vector(state.position_mm), *_vector(state.position_sd_mm), *rotation,
                *_vector(state.rotation_sd_deg),
                state.coronal_tilt_deg, state.coronal_tilt_sd_deg, state.sagittal_tilt_deg,
                state.sagittal_tilt_sd_deg, state.axial_rotation_deg, state.axial_rotation_sd_deg,
                state.lateral_displacement_mm, state.lateral_displacement_sd_mm,
                *_interval(state.coronal_tilt_interval_deg), *_interval(state.sagittal_tilt_interval_deg),
                *_interval(state.axial_rotation_interval_deg), *_interval(state.lateral_displacement_interval_mm),
                None if state.status is None else state.status.value, _reason(state),
            ]  # fmt: skip


def _reason(state: VertebraState) -> str | None:
    """Return why a vertebra has no pose or is bracketed, has no displacement, or has a position without an error."""
    return state.reason or state.bracketed_reason or state.not_measured_reason or state.position_reason


def _curve_rows(summary: SurgerySummary, stage: str | None) -> Iterator[Row]:
    for spine in selected_spines(summary, stage):
        for curve in spine.curves:
            yield [
                spine.stage, spine.take, curve.name, curve.upper, curve.apex, curve.lower, curve.side,
                " ".join(curve.open_ends),
            ]  # fmt: skip


def _changes(spine: StageSpine) -> Iterator[SpineChange]:
    baseline, previous = spine.since_baseline, spine.since_previous
    if baseline is not None:
        yield baseline
    if previous is not None and (baseline is None or previous.since != baseline.since):
        yield previous


def _motion_rows(summary: SurgerySummary, stage: str | None) -> Iterator[Row]:
    for spine in selected_spines(summary, stage):
        for change in _changes(spine):
            for moved in change.vertebrae:
                yield [
                    spine.stage, spine.take, change.since.name, change.since.take, moved.vertebra,
                    moved.origin.value, *_vector(moved.translation_mm), *_vector(moved.translation_sd_mm),
                    *_vector(moved.rotation_vector_deg), *_vector(moved.rotation_sd_deg),
                    moved.angle_deg, moved.angle_sd_deg, *_interval(angle_interval(moved)),
                    moved.derotation_deg, moved.derotation_sd_deg,
                    moved.coronal_deg, moved.coronal_sd_deg, moved.sagittal_deg, moved.sagittal_sd_deg,
                    moved.distraction_mm, moved.distraction_sd_mm, moved.reason,
                ]  # fmt: skip


def _measure_rows(summary: SurgerySummary, stage: str | None) -> Iterator[Row]:
    for spine in selected_spines(summary, stage):
        for value in spine.measures:
            yield _measure_row(spine, "value", None, value)
        for change in _changes(spine):
            for value in change.measures:
                yield _measure_row(spine, "change", change.since.name, value)
        for value in spine.target_measures or ():
            yield _measure_row(spine, "remaining to the target", None, value)


def _measure_row(spine: StageSpine, kind: str, since: str | None, value: MeasureValue) -> Row:
    return [
        spine.stage, spine.take, kind, since, value.definition, value.curve, " ".join(value.levels),
        *_in_unit(value.unit, [value.value, value.sd, *_interval(value.interval)]),
        value.status.value, value.assumed, " ".join(open_ends(spine).get(value.curve or "", ())), value.reason,
    ]  # fmt: skip


def _attribution_rows(summary: SurgerySummary, stage: str | None) -> Iterator[Row]:
    for spine in selected_spines(summary, stage):
        for change in _changes(spine):
            for item in change.attribution:
                parts = (item.total, item.rotation, item.distraction, item.remainder_share)
                shares = [number for part in parts for number in _in_unit(item.unit, _share(part))]
                yield [
                    spine.stage, spine.take, change.since.name, item.subject, item.quantity, " ".join(item.levels),
                    *shares,
                    None if item.status is None else item.status.value, item.assumed, item.reason,
                ]  # fmt: skip


def _share(share: Share) -> Row:
    return [share.value, share.sd, *_interval(share.interval)]


def _remaining_rows(summary: SurgerySummary, stage: str | None) -> Iterator[Row]:
    for spine in selected_spines(summary, stage):
        for left in spine.remaining or ():
            yield [
                spine.stage, spine.take, left.vertebra, left.coronal_deg, left.sagittal_deg, left.axial_deg,
                *left.sd_deg, *left.translation_mm, *left.translation_sd_mm,
            ]  # fmt: skip


def _triad_rows(summary: SurgerySummary, stage: str | None) -> Iterator[Row]:
    for found in selected_stages(summary, stage):
        for triad in found.triads or ():
            yield [found.name, found.take, *_triad(triad)]


def _triad(triad: Triad) -> Row:
    return [
        triad.label, triad.label_reason, *_vector(triad.position_mm), *_vector(triad.position_sd_mm),
        *_vector(triad.normal), *_vector(triad.angles_deg), *_vector(triad.rotation_sd_deg), triad.reason,
    ]  # fmt: skip


def _flag_rows(summary: SurgerySummary, stage: str | None) -> Iterator[Row]:
    for found in selected_stages(summary, stage):
        for flag in found.flags or ():
            yield [found.name, found.take, "triads", flag.code, flag.detail]
        if found.spine is not None:
            for flag in found.spine.flags:
                yield [found.name, found.take, "spine", flag.code, flag.detail]


def _definition_rows(summary: SurgerySummary, stage: str | None) -> Iterator[Row]:
    for identifier, fields in definition_table(definitions_of(selected_spines(summary, stage))).items():
        yield [identifier, *(fields.get(name) for name in ("name", "unit", "formula", "sign", "reference"))]


_Rows = Callable[[SurgerySummary, str | None], Iterator[Row]]

_WRITERS: Mapping[str, tuple[list[str], _Rows]] = {
    "stages": (
        ["surgery_id", "reference", "stage", "take", "state", "captured_at", "created_at", "calibration_id",
         "left_sha256", "right_sha256", "frame", "reference_vertebra", "reference_line", "initial", "baseline",
         "spine_reason", "version"],
        _stage_rows,
    ),
    "vertebrae": (
        ["stage", "take", "vertebra", "origin", "marked", *_axis_columns("position", "mm"),
         *_axis_columns("position_sd", "mm"), *(f"rotation_{row}{column}" for row in "123" for column in "123"),
         *_axis_columns("own_rotation_sd", "deg"),
         "coronal_tilt_deg", "coronal_tilt_sd_deg", "sagittal_tilt_deg", "sagittal_tilt_sd_deg",
         "axial_rotation_deg", "axial_rotation_sd_deg", "lateral_displacement_mm", "lateral_displacement_sd_mm",
         *_end_columns("coronal_tilt", "deg"), *_end_columns("sagittal_tilt", "deg"),
         *_end_columns("axial_rotation", "deg"), *_end_columns("lateral_displacement", "mm"), "status", "reason"],
        _vertebra_rows,
    ),
    "curves": (["stage", "take", "curve", "upper", "apex", "lower", "side", "open_ends"], _curve_rows),
    "motion": (
        ["stage", "take", "since_stage", "since_take", "vertebra", "origin", *_axis_columns("translation", "mm"),
         *_axis_columns("translation_sd", "mm"), *_axis_columns("rotation", "deg"),
         *_axis_columns("rotation_sd", "deg"), "angle_deg", "angle_sd_deg", *_end_columns("angle", "deg"),
         "derotation_deg", "derotation_sd_deg",
         "coronal_deg", "coronal_sd_deg", "sagittal_deg", "sagittal_sd_deg", "distraction_mm",
         "distraction_sd_mm", "reason"],
        _motion_rows,
    ),
    "measures": (
        ["stage", "take", "kind", "since_stage", "definition", "curve", "levels", *_value_columns("value"), "status",
         "assumed", "open_ends", "reason"],
        _measure_rows,
    ),
    "attribution": (
        ["stage", "take", "since_stage", "subject", "definition", "levels", *_value_columns("total"),
         *_value_columns("rotation"), *_value_columns("distraction"), *_value_columns("remainder"), "status",
         "assumed", "reason"],
        _attribution_rows,
    ),
    "remaining": (
        ["stage", "take", "vertebra", "coronal_deg", "sagittal_deg", "axial_deg", "coronal_sd_deg",
         "sagittal_sd_deg", "axial_sd_deg", *_axis_columns("translation", "mm"),
         *_axis_columns("translation_sd", "mm")],
        _remaining_rows,
    ),
    "triads": (
        ["stage", "take", "vertebra", "vertebra_reason", *_axis_columns("object_position", "mm", _OBJECT_AXES),
         *_axis_columns("object_position_sd", "mm", _OBJECT_AXES), *(f"object_normal_{axis}" for axis in "xyz"),
         *_axis_columns("object_normal_angle", "deg", _OBJECT_AXES),
         *_axis_columns("own_rotation_sd", "deg", _OBJECT_AXES), "reason"],
        _triad_rows,
    ),
    "flags": (["stage", "take", "result", "code", "detail"], _flag_rows),
    "definitions": (["definition", "name", "unit", "formula", "sign", "reference"], _definition_rows),
}  # fmt: skip
