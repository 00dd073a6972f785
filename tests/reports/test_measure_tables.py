import pytest

from reports.measure_tables import STAGES_PER_TABLE, cell, levels_text, measure_tables, name_of, row_of
from spinewatch.spine.definitions import DEFINITIONS
from spinewatch.spine.results import MeasureStatus
from tests.contract.spine_results import measure, stage_spine


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
    assert [(row.definition, row.levels, row.cells[1].value) for row in whole.rows] == [
        ("kyphosis", "T5–T12", "–"),
        ("lordosis", "L1–L5", "–"),
        ("kyphosis", "T7–T12", "32.5°"),
        ("kyphosis", "T10–L1", "5.5°"),
    ]


def test_a_curve_has_one_row_for_a_definition_whose_vertebrae_change() -> None:
    stages = [("S0", ["T7", "L1"]), ("S1", ["T8", "L1"])]
    columns = [(name, [measure("cobb-reselected", 5.0, levels=levels)]) for name, levels in stages]
    (found,) = measure_tables(columns)
    (row,) = found.rows
    assert [cell.note for cell in row.cells] == ["", "T8–L1"]
    assert row_of(columns[0][1][0]) == row_of(columns[1][1][0])


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
