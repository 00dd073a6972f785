import json

import numpy as np
import pytest

from spinewatch.spine.legacy_1995 import TriadRow, legacy_flags, legacy_motion, triad_table
from spinewatch.spine.motion import ReferenceMissingError
from spinewatch.triads.pose import Pose
from tests.paths import DATA

PRINTED = json.loads((DATA / "thesis_tables.json").read_text())["table_6_1"]


def table(stage: str) -> list[TriadRow]:
    return [
        TriadRow(row["vertebra"], np.array(row["position_mm"]), np.zeros(3), np.array(row["angles_deg"]), 0.0)
        for row in PRINTED
        if row["stage"] == stage
    ]


def test_table_6_1_gives_its_motions() -> None:
    motions = legacy_motion(table("Pre"), table("Post"))
    assert [motion.vertebra for motion in motions] == ["L1", "T11", "T9", "T7"]
    assert [motion.angle_deg for motion in motions] == pytest.approx([1.64, 40.92, 22.02, 15.32], abs=0.005)
    assert [motion.displacement_mm for motion in motions] == pytest.approx(
        [0, 14.25, 17.33, 23.93], abs=0.005
    )
    assert all(motion.angle_sd_deg == 0 for motion in motions)


def test_t11_of_table_6_1_is_flagged() -> None:
    flags = legacy_flags(table("Pre"), table("Post"))
    assert {flag.code for flag in flags} == {
        "intervertebral-distance-implausible",
        "intervertebral-rotation-implausible",
    }
    assert all("T11" in flag.detail for flag in flags)
    assert any("62.7 mm apart and are 74.9 mm" in flag.detail for flag in flags)


def test_without_t11_nothing_is_flagged() -> None:
    before, after = ([row for row in table(stage) if row.vertebra != "T11"] for stage in ("Pre", "Post"))
    assert legacy_flags(before, after) == ()


def test_a_table_has_positions_relative_to_the_reference_in_object_axes() -> None:
    tilted = np.array([[1.0, 0, 0], [0, 0.8, 0.6], [0, -0.6, 0.8]])
    covariance = np.diag([0.09, 0.16, 0.25, 1.0, 4.0, 9.0])
    poses = {
        "L1": Pose(np.array([1.0, 2, 3]), np.eye(3), covariance),
        "T9": Pose(np.array([11.0, 22, 33]), tilted, covariance),
    }
    reference, row = triad_table(poses, "L1")
    assert row.position_mm == pytest.approx([10, 20, 30])
    assert row.position_sd_mm == pytest.approx(np.sqrt([0.18, 0.32, 0.5]))
    assert row.angles_deg == pytest.approx([90, np.degrees(np.arccos(0.6)), np.degrees(np.arccos(0.8))])
    assert reference.position_mm == pytest.approx(np.zeros(3))
    assert not reference.position_sd_mm.any()
    assert row.tilt_sd_deg == pytest.approx(np.sqrt(4 * 0.64 + 9 * 0.36))


def test_a_stage_without_the_reference_has_no_table() -> None:
    with pytest.raises(ReferenceMissingError, match="L1"):
        triad_table({"T9": Pose(np.zeros(3), np.eye(3), np.eye(6))}, "L1")


def test_deviations_of_the_displacement_are_those_along_it() -> None:
    def row(x: float) -> TriadRow:
        return TriadRow("T9", np.array([x, 0, 0]), np.array([0.3, 9, 9]), np.array([90.0, 90, 0]), 0.6)

    (motion,) = legacy_motion([row(0)], [row(5)])
    assert motion.displacement_mm == pytest.approx(5)
    assert motion.displacement_sd_mm == pytest.approx(0.3 * np.sqrt(2))
    assert motion.angle_sd_deg == pytest.approx(0.6 * np.sqrt(2))
