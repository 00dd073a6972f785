import pytest

from contract.spine import Share
from reports.surgery_tables import (
    STAGES_PER_TABLE,
    attribution_table,
    cell,
    headlines,
    levels_text,
    measure_tables,
    motion_table,
    name_of,
    not_drawn,
    remaining_table,
    vertebra_table,
)
from spinewatch.spine.definitions import DEFINITIONS
from spinewatch.spine.results import MeasureStatus
from tests.contract.spine_results import change, measure, stage_spine


def test_names_come_from_the_registry() -> None:
    assert name_of("cobb-fixed") == DEFINITIONS["cobb-fixed"].name
    assert name_of("from-a-later-version") == "from-a-later-version"
    assert levels_text([]) == ""
    assert levels_text(["T5", "T9", "T12"]) == "T5–T12"


def test_a_measured_value_has_its_interval_and_no_mark() -> None:
    found = cell(measure("cobb-fixed", 58.3), ["T7", "L1"])
    assert (found.value, found.interval, found.mark, found.note) == ("58.3°", "56.1 to 60.5°", "", "")


def test_a_bracketed_value_has_its_mark_and_reason_and_its_own_vertebrae() -> None:
    bracketed = measure(
        "cobb-reselected",
        59.0,
        levels=["T7", "T12"],
        status=MeasureStatus.BRACKETED,
        reason="T12 has no marker",
    )
    found = cell(bracketed, ["T7", "L1"])
    assert (found.mark, found.note) == ("bracketed", "T7–T12: T12 has no marker")
    assert cell(bracketed.model_copy(update={"assumed": True}), ["T7", "T12"]).mark == "bracketed, assumed"


@pytest.mark.parametrize("value", [None, 0.0])
def test_what_was_not_measured_is_a_dash_with_its_reason_never_a_number(value: float | None) -> None:
    absent = measure("kyphosis", value, status=MeasureStatus.NOT_MEASURED, reason="L5 was not measured")
    found = cell(absent, ["T7", "L1"])
    assert (found.value, found.interval, found.mark, found.note) == (
        "–",
        "",
        "not measured",
        "L5 was not measured",
    )
    assert cell(None).value == "–"
    assert cell(measure("kyphosis", None)).mark == "not measured"


def test_changes_have_signs() -> None:
    found = cell(measure("cobb-fixed", 3.0), ["T7", "L1"], signed=True)
    assert (found.value, found.interval) == ("+3.0°", "+0.8 to +5.2°")


def test_measures_are_tables_of_curves_and_then_of_the_spine() -> None:
    columns = [(f"S{number}", stage_spine(number).measures) for number in range(3)]
    curve, whole = measure_tables(columns)
    assert (curve.subject, whole.subject) == ("curve 1", "")
    assert curve.columns == ("S0", "S1", "S2")
    assert [row.definition for row in curve.rows] == [
        "cobb-fixed",
        "cobb-reselected",
        "apical-rotation",
        "apical-translation",
    ]
    assert [found.value for found in curve.rows[0].cells] == ["58.3°", "35.0°", "11.7°"]
    assert curve.rows[3].cells[0].value == "21.7 mm"


def test_a_missing_measure_is_a_dash() -> None:
    columns = [("S0", [measure("cobb-fixed", 1.0)]), ("S1", [measure("ferguson", 2.0)])]
    (found,) = measure_tables(columns)
    assert [cell.value for cell in found.rows[0].cells] == ["1.0°", "–"]
    assert found.rows[0].cells[1].note == "not reported for this stage"


@pytest.mark.parametrize(("count", "widths"), [(0, []), (1, [1]), (5, [5]), (6, [3, 3]), (11, [4, 4, 3])])
def test_many_stages_are_several_tables_of_even_width(count: int, widths: list[int]) -> None:
    columns = [(f"S{number}", [measure("cobb-fixed", 1.0)]) for number in range(count)]
    found = measure_tables(columns)
    assert [len(table.columns) for table in found] == widths
    assert max(widths, default=0) <= STAGES_PER_TABLE
    assert [name for table in found for name in table.columns] == [name for name, _ in columns]


def test_measures_of_single_vertebrae_are_not_in_the_tables_of_measures() -> None:
    assert measure_tables([("PRE", [measure("coronal-tilt", 1.0, curve=None, levels=["T9"])])]) == ()


def test_vertebrae_have_positions_and_tilts_with_deviations() -> None:
    found = vertebra_table(stage_spine(0))
    rows = {row[0]: row for row in found.rows}
    assert rows["T9"][1:4] == ("measured", "+8.0 ± 0.3", "−21.7 ± 0.3")
    assert rows["T5"] == ("T5", "not measured", *["–"] * 6)
    assert found.notes == ("T5, T6, L2: it lies outside the marked vertebrae T7 to L1",)
    assert all(len(row) == len(found.columns) for row in found.rows)


def test_motion_has_every_component_with_its_deviation() -> None:
    found = motion_table("POST", change(0, 2))
    assert found.title == "POST since PRE"
    row = next(row for row in found.rows if row[0] == "T9")
    assert dict(zip(found.columns, row, strict=True)) == {
        "vertebra": "T9",
        "pose": "measured",
        "anterior mm": "0.0 ± 0.4",
        "left mm": "+17.3 ± 0.4",
        "cephalad mm": "0.0 ± 0.6",
        "coronal °": "+6.0 ± 1.1",
        "sagittal °": "−1.0 ± 1.1",
        "derotation °": "+2.5 ± 0.6",
        "angle °": "+6.6 ± 1.0",
        "distraction mm": "+1.5 ± 0.5",
    }
    assert found.notes == ("T5, T6, L2: it was not measured",)


def test_attribution_has_intervals_and_a_reason_where_there_is_none() -> None:
    whole = change(0, 2)
    found = attribution_table("POST", whole)
    ((subject, quantity, total, rotation, distraction, remainder),) = found.rows
    assert (subject, quantity, total.value, rotation.value, distraction.value, remainder) == (
        "curve 1",
        "cobb-fixed",
        "−23.3°",
        "−18.0°",
        "−5.1°",
        "−0.2°",
    )
    assert rotation.interval == "−20.0 to −16.0°"
    nothing = Share(value=None, sd=None, interval=None)
    part = whole.attribution[0].model_copy(
        update={"rotation": nothing, "reason": "the plane is not determined"}
    )
    found = attribution_table("POST", whole.model_copy(update={"attribution": [part]}))
    assert (found.rows[0][3].value, found.rows[0][3].mark) == ("–", "not measured")
    assert found.notes == ("curve 1: the plane is not determined",)


def test_what_remains_is_a_table_only_with_a_target() -> None:
    found = remaining_table(stage_spine(2))
    assert found is not None
    assert found.rows == (("T9", "−1.0 ± 0.8", "+0.5 ± 0.8", "−3.0 ± 0.4", "–", "–", "–"),)
    assert "no position" in found.notes[0]
    assert remaining_table(stage_spine(2).model_copy(update={"remaining": None})) is None


def test_headlines_give_both_ends_and_the_change_with_intervals() -> None:
    cobb, rotation = headlines(
        stage_spine(0), stage_spine(2), "curve 1", ("cobb-fixed", "apical-rotation", "ferguson")
    )
    assert cobb.after is not None
    assert cobb.change is not None
    assert rotation.change is not None
    assert (cobb.before.value, cobb.after.value, cobb.change.value) == ("58.3°", "11.7°", "−23.3°")
    assert cobb.change.interval == "−25.5 to −21.1°"
    assert (rotation.change.value, rotation.change.note) == ("–", "no change was reported")


def test_a_single_stage_has_no_change() -> None:
    only = stage_spine(0)
    (cobb,) = headlines(only, only, "curve 1", ("cobb-fixed",))
    assert (cobb.before.value, cobb.after, cobb.change) == ("58.3°", None, None)


def test_what_has_no_pose_is_named() -> None:
    assert not_drawn(stage_spine(0)) == "T5, T6, L2"
