from reports.vertebra_tables import motion_table, not_drawn, remaining_table, vertebra_table
from tests.contract.spine_results import change, stage_spine


def test_vertebrae_have_positions_and_tilts_with_deviations() -> None:
    found = vertebra_table(stage_spine(0))
    rows = {row[0]: row for row in found.rows}
    assert rows["T9"][1:4] == ("measured", "+8.0 ± 0.3", "−21.7 ± 0.3")
    assert rows["T5"] == ("T5", "not measured", *["–"] * 6)
    assert found.notes == (
        "T5, T6, L2: it lies outside the marked vertebrae T7 to L1",
        "L1: its centroid is the origin by definition",
    )
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
        "angle ° (95%)": "6.6 (4.6 to 8.6)",
        "distraction mm": "+1.5 ± 0.5",
    }
    assert found.notes == ("T5, T6, L2: it was not measured",)


def test_what_remains_is_a_table_only_with_a_target() -> None:
    found = remaining_table(stage_spine(2))
    assert found is not None
    assert found.rows == (("T9", "−1.0 ± 0.8", "+0.5 ± 0.8", "−3.0 ± 0.4", "–", "–", "–"),)
    assert "no position" in found.notes[0]
    assert remaining_table(stage_spine(2).model_copy(update={"remaining": None})) is None


def test_what_has_no_pose_is_named() -> None:
    assert not_drawn(stage_spine(0)) == "T5, T6, L2"
