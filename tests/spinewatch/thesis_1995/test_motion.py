import json
from typing import Any

import numpy as np
import pytest

from spinewatch.thesis_1995.motion import axis_and_angle, move_body, normal_from_angles
from tests.paths import DATA

TABLE = json.loads((DATA / "thesis_tables.json").read_text())["table_6_1"]


def rows(vertebra: str) -> tuple[dict[str, Any], dict[str, Any]]:
    pre, post = (row for row in TABLE if row["vertebra"] == vertebra)
    assert (pre["stage"], post["stage"]) == ("Pre", "Post")
    return pre, post


@pytest.mark.parametrize(("vertebra", "angle"), [("L1", 1.64), ("T11", 40.92), ("T9", 22.02), ("T7", 15.32)])
def test_the_angles_between_the_normals_of_table_6_1(vertebra: str, angle: float) -> None:
    pre, post = (normal_from_angles(row["angles_deg"]) for row in rows(vertebra))
    axis, found = axis_and_angle(pre, post)
    assert found == pytest.approx(angle, abs=0.005)
    assert found == pytest.approx(np.degrees(np.arccos(pre @ post)), abs=1e-9)
    assert axis @ pre == pytest.approx(0, abs=1e-12)


def test_t11_of_table_6_1_moves_implausibly_far_from_its_reference() -> None:
    pre, post = (np.linalg.norm(row["position_mm"]) for row in rows("T11"))
    assert pre == pytest.approx(62.7, abs=0.05)
    assert post == pytest.approx(74.9, abs=0.05)


def test_printed_cosines_are_not_quite_unit_vectors() -> None:
    norms = [np.square(np.cos(np.radians(row["angles_deg"]))).sum() for row in TABLE]
    assert max(abs(n - 1) for n in norms) > 3e-4
    assert all(np.linalg.norm(normal_from_angles(row["angles_deg"])) == pytest.approx(1) for row in TABLE)


def test_angles_beyond_a_right_angle_fold() -> None:
    far = np.array([np.sin(np.radians(120)), 0, np.cos(np.radians(120))])
    assert axis_and_angle(np.array([0.0, 0, 1]), far)[1] == pytest.approx(60)


def test_a_body_rotates_with_the_normal_and_keeps_its_offset() -> None:
    z, x = np.array([0.0, 0, 1]), np.array([1.0, 0, 0])
    position, axis = move_body(np.array([0.0, 0, -30]), x, np.zeros(3), np.array([5.0, 0, 0]), z, x)
    assert np.allclose(position, [5, 0, -30])
    assert np.allclose(axis, -z)


def test_parallel_normals_have_no_axis() -> None:
    z = np.array([0.0, 0, 1])
    axis, angle = axis_and_angle(z, z)
    assert not axis.any()
    assert angle == 0
