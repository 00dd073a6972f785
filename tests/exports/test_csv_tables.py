"""CSV tables: units in every header, definitions in every measure, and every number of the summary again."""

from __future__ import annotations

import csv
import io
import re
import zipfile

import pytest

from contract.pose import pose_fields
from contract.summary import SurgerySummary
from contract.triad import Triad
from exports.csv_tables import TABLES, UnknownUnitError, export, table
from exports.selection import UnknownStageError
from spinewatch.spine.definitions import DEFINITIONS
from tests.contract.spine_results import pose
from tests.exports.hostile import TEXTS, many_stages, with_text, without_spines

TEXT_COLUMNS = {
    "surgery_id", "reference", "stage", "take", "state", "captured_at", "created_at", "calibration_id",
    "upper", "apex", "lower", "side", "open_ends",
    "left_sha256", "right_sha256", "frame", "reference_vertebra", "reference_line", "initial", "baseline",
    "spine_reason", "version", "vertebra", "vertebra_reason", "origin", "marked", "reason", "since_stage",
    "since_take", "kind", "definition", "curve", "levels", "status", "assumed", "subject", "result", "code",
    "detail", "name", "unit", "formula", "sign",
}  # fmt: skip
PURE_NUMBER = re.compile(r"rotation_[123]{2}|object_normal_[xyz]")


def read(summary: SurgerySummary, name: str, stage: str | None = None) -> list[dict[str, str]]:
    text = table(summary, name, stage).decode()
    return list(csv.DictReader(io.StringIO(text, newline=""), strict=True))


def one(rows: list[dict[str, str]], **values: str) -> dict[str, str]:
    (row,) = (row for row in rows if all(row[name] == value for name, value in values.items()))
    return row


def test_the_archive_has_every_table(summary: SurgerySummary) -> None:
    with zipfile.ZipFile(io.BytesIO(export(summary))) as archive:
        assert archive.namelist() == [f"{name}.csv" for name in TABLES]
        assert archive.read("measures.csv") == table(summary, "measures")


@pytest.mark.parametrize("name", TABLES)
def test_every_number_has_its_unit_in_the_header(name: str, summary: SurgerySummary) -> None:
    header = table(summary, name).decode().split("\r\n")[0].split(",")
    assert len(set(header)) == len(header)
    for column in header:
        assert column in TEXT_COLUMNS or column.endswith(("_mm", "_deg")) or PURE_NUMBER.fullmatch(column)


@pytest.mark.parametrize("name", TABLES)
def test_rows_are_as_long_as_the_header(name: str, summary: SurgerySummary) -> None:
    rows = read(with_triads(summary), name)
    assert rows
    for row in rows:
        assert None not in row
        assert None not in row.values()


def with_triads(summary: SurgerySummary) -> SurgerySummary:
    triad = Triad(
        **pose_fields(pose("T9", 0), None), label="T9", label_reason=None, model="m", error_mm=0.1, balls={}
    )
    lost = Triad(
        **pose_fields(None, "a ball is hidden"), label=None, label_reason="two fit", model="m", error_mm=0.1,
        balls={},
    )  # fmt: skip
    stage = summary.stages[0].model_copy(update={"triads": [triad, lost]})
    return summary.model_copy(update={"stages": [stage, *summary.stages[1:]]})


def test_vertebrae(summary: SurgerySummary) -> None:
    rows = read(summary, "vertebrae")
    assert len(rows) == 30
    row, body = one(rows, stage="POST", vertebra="T9"), pose("T9", 2)
    axes = ("x_anterior", "y_left", "z_cephalad")
    assert [float(row[f"position_{axis}_mm"]) for axis in axes] == body.position_mm.tolist()
    assert [float(row[f"rotation_{i}{j}"]) for i in "123" for j in "123"] == body.rotation.ravel().tolist()
    assert (row["origin"], row["marked"], row["axial_rotation_deg"]) == ("measured", "true", "4.25")
    between = one(rows, stage="PRE", vertebra="T8")
    assert (between["status"], between["reason"]) == ("bracketed", "T8 has no marker at this stage")
    assert float(between["axial_rotation_lower95_deg"]) == pytest.approx(4.25 - 1.959964 * 0.8 - 3.0)
    assert float(between["axial_rotation_upper95_deg"]) == pytest.approx(4.25 + 1.959964 * 0.8)
    lost = one(rows, stage="PRE", vertebra="T5")
    assert (lost["position_x_anterior_mm"], lost["coronal_tilt_deg"]) == ("", "")
    assert lost["reason"] == "it lies outside the marked vertebrae T7 to L1"


def test_motion_is_since_the_baseline_and_since_the_stage_before(summary: SurgerySummary) -> None:
    rows = read(summary, "motion")
    assert [(row["stage"], row["since_stage"]) for row in rows if row["vertebra"] == "T9"] == [
        ("INTER", "PRE"), ("POST", "PRE"), ("POST", "INTER"),
    ]  # fmt: skip
    row = one(rows, stage="POST", since_stage="PRE", vertebra="T9")
    moved = pose("T9", 2).position_mm - pose("T9", 0).position_mm
    assert float(row["translation_y_left_mm"]) == moved[1]
    assert (row["rotation_x_anterior_deg"], row["derotation_deg"], row["distraction_mm"]) == (
        "6.0",
        "2.5",
        "1.5",
    )


def test_curves_have_their_apex_side_and_open_ends(summary: SurgerySummary) -> None:
    row = one(read(summary, "curves"), stage="INTER")
    assert (row["curve"], row["upper"], row["apex"], row["lower"]) == ("curve 1", "T7", "T9", "L1")
    assert (row["side"], row["open_ends"]) == ("right", "L1")
    measures = read(summary, "measures", "INTER")
    assert {row["open_ends"] for row in measures if row["curve"]} == {"L1"}
    assert {row["open_ends"] for row in measures if not row["curve"]} == {""}


def test_measures_are_in_the_columns_of_their_unit(summary: SurgerySummary) -> None:
    rows = read(summary, "measures")
    cobb = one(rows, stage="PRE", kind="value", definition="cobb-fixed")
    assert (cobb["value_deg"], cobb["value_sd_deg"], cobb["value_mm"]) == ("58.3", "1.1", "")
    assert [float(cobb[f"value_{end}95_deg"]) for end in ("lower", "upper")] == pytest.approx(
        [56.144, 60.456]
    )
    assert (cobb["levels"], cobb["status"], cobb["assumed"]) == ("T7 L1", "measured", "false")
    shift = one(rows, stage="PRE", kind="value", definition="apical-translation")
    assert (shift["value_deg"], shift["value_mm"]) == ("", "21.7")
    assert {row["kind"] for row in rows} == {"value", "change", "remaining to the target"}
    assert {row["definition"] for row in rows} <= set(DEFINITIONS)


def test_every_pair_of_vertebrae_has_its_row(summary: SurgerySummary) -> None:
    rows = [row for row in read(summary, "measures", "INTER") if row["definition"] == "kyphosis"]
    assert [(row["kind"], row["levels"], row["value_deg"]) for row in rows] == [
        ("value", "T5 T12", ""), ("value", "T7 T12", "32.5"), ("value", "T10 L1", "5.5"),
        ("change", "T7 T12", "1.25"), ("change", "T10 L1", "-0.75"),
    ]  # fmt: skip


def test_attribution_remaining_flags_and_definitions(summary: SurgerySummary) -> None:
    rows = read(summary, "attribution")
    row = one(rows, stage="POST", since_stage="PRE", definition="cobb-fixed")
    assert (row["levels"], row["status"], row["assumed"]) == ("T7 L1", "measured", "false")
    apex = one(rows, stage="POST", since_stage="PRE", definition="apical-translation")
    assert (apex["levels"], apex["status"], apex["reason"]) == ("T8", "bracketed", "T8 has no marker")
    assert (row["definition"], row["total_deg"], row["rotation_deg"], row["distraction_deg"]) == (
        "cobb-fixed", "-23.3", "-18.0", "-5.1"
    )  # fmt: skip
    assert (row["remainder_deg"], row["remainder_sd_deg"], row["total_mm"]) == ("-0.2", "0.1", "")
    assert one(read(summary, "remaining"), stage="PRE")["axial_deg"] == "-3.0"
    assert read(summary, "flags") == [
        {
            "stage": "POST",
            "take": "1",
            "result": "spine",
            "code": "rig-refined",
            "detail": "an example of a flag",
        }
    ]
    known = one(read(summary, "definitions"), definition="cobb-fixed")
    assert known["formula"].removeprefix("'") == DEFINITIONS["cobb-fixed"].formula


def test_triads(summary: SurgerySummary) -> None:
    first, second = read(with_triads(summary), "triads")
    assert (first["vertebra"], float(first["object_position_z_mm"])) == ("T9", 108.0)
    assert (second["vertebra"], second["vertebra_reason"], second["reason"]) == (
        "",
        "two fit",
        "a ball is hidden",
    )


def test_stages_with_and_without_a_spine(summary: SurgerySummary) -> None:
    rows = read(summary, "stages")
    assert [row["state"] for row in rows] == ["succeeded", "succeeded", "succeeded", "failed"]
    assert (rows[0]["baseline"], rows[3]["baseline"]) == ("PRE", "")
    assert rows[3]["spine_reason"] == "the stage was not measured"
    assert len(read(summary, "stages", "INTER")) == 1
    assert read(without_spines(), "measures") == []
    with pytest.raises(UnknownStageError):
        table(summary, "stages", "LATER")


@pytest.mark.parametrize("text", TEXTS)
@pytest.mark.parametrize("name", TABLES)
def test_hostile_text_is_harmless_and_reads_back(text: str, name: str) -> None:
    rows = read(with_text(text), name)
    assert bool(rows) == (name != "triads")  # the example surgery has none
    for row in rows:
        for column, cell in row.items():
            if column in TEXT_COLUMNS:
                assert not cell.lstrip(" ").startswith(tuple("=+-@\t\r"))
        if name == "flags":
            assert row["detail"].removeprefix("'" if text.strip(" ")[:1] in set("=+-@\t\r'") else "") == (
                text.replace("\x00", "\ufffd")
            )


def test_a_unit_without_a_column_is_refused(summary: SurgerySummary) -> None:
    stage = summary.stages[0]
    assert stage.spine is not None
    measures = [stage.spine.measures[0].model_copy(update={"unit": "rad"})]
    spine = stage.spine.model_copy(update={"measures": measures})
    changed = summary.model_copy(update={"stages": [stage.model_copy(update={"spine": spine})]})
    with pytest.raises(UnknownUnitError, match="'rad'; export JSON"):
        table(changed, "measures")


def test_sixty_stages() -> None:
    assert len(read(many_stages(), "vertebrae")) == 60 * 17
