import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spinewatch.errors import ParameterError
from spinewatch.markers import (
    FLAT_10_14_18,
    MODELS,
    TriadModel,
    flat_triad,
    marker,
    orthogonal_triad,
    parse_marker,
    scaled,
)
from tests.paths import DATA

TABLES = json.loads((DATA / "thesis_tables.json").read_text())
BODY = np.array([[18.0, 0, 0], [0, -15, 0], [-11, 0, 0], [0, 13, 9]])


def test_distances_round_to_table_5_3() -> None:
    printed = TABLES["table_5_3_reference_mm"]
    expected = [printed["XX_YY"], printed["XX_MX"], printed["YY_MX"]]
    assert np.abs(FLAT_10_14_18.distances_mm - expected).max() < 0.05


def test_the_legs_meet_at_the_origin_and_the_normal_is_z() -> None:
    xx, yy, mx = FLAT_10_14_18.coordinates_mm
    assert [np.linalg.norm(b) for b in (xx, yy, mx)] == [18, 14, 10]
    assert np.allclose(xx / 18, -mx / 10)
    assert np.allclose(np.cross(xx - mx, xx - yy) / 392, [0, 0, 1])


def test_the_orthogonal_marker_has_its_legs_at_right_angles() -> None:
    balls = orthogonal_triad(30, 22, 16).coordinates_mm
    assert np.allclose(balls @ balls.T, np.diag([30**2, 22**2, 16**2]))
    assert np.ptp(balls[:, 2]) < 1e-9  # z is the normal of the balls' plane
    assert balls[0, 2] > 0


def test_sizes_scale_distances_only() -> None:
    large = scaled(FLAT_10_14_18, 1.5)
    assert np.allclose(large.distances_mm, 1.5 * FLAT_10_14_18.distances_mm)
    assert large.ball_diameter_mm == 8
    assert flat_triad(20, 15, 12).name == "flat-12-15-20"


def test_four_balls_have_a_chirality_and_a_flat_marker_has_none() -> None:
    body = TriadModel("body", ("A", "B", "C", "D"), BODY, 8.0)
    turned = BODY @ Rotation.from_euler("xyz", [0.3, 1.0, -2.0]).as_matrix().T + 5
    assert body.chirality != 0
    assert body.matches_chirality(np.stack([turned, -turned])).tolist() == [True, False]
    assert FLAT_10_14_18.matches_chirality(turned[:3]).all()
    part = body.without(3)
    assert part is not None
    assert part.balls == ("A", "B", "C")


@pytest.mark.parametrize(
    ("balls", "coordinates", "message"),
    [
        ("ABC", [[0, 0, 0], [10, 0, 0], [0, 10, 0]], "cannot be identified"),
        ("ABC", [[0, 0, 0], [10, 0, 0], [25, 0, 0]], "on a line"),
        ("AB", [[0, 0, 0], [10, 0, 0]], "three or four"),
        ("ABB", [[0, 0, 0], [10, 0, 0], [0, 15, 0]], "three or four"),
    ],
)
def test_markers_that_cannot_work_are_refused(
    balls: str, coordinates: list[list[float]], message: str
) -> None:
    with pytest.raises(ParameterError, match=message):
        TriadModel("bad", tuple(balls), np.array(coordinates, dtype=float), 8.0)


def test_a_marker_is_looked_up_by_name() -> None:
    assert marker("flat-10-14-18") is FLAT_10_14_18
    assert all(marker(name).name == name for name in MODELS)
    with pytest.raises(ParameterError, match="flat-10-14-18"):
        marker("round")


def test_a_marker_is_described_by_its_legs() -> None:
    assert parse_marker("flat-10-14-18") is FLAT_10_14_18
    assert parse_marker("flat:18,14,10").distances_mm.tolist() == FLAT_10_14_18.distances_mm.tolist()
    assert parse_marker("orthogonal:30,25,20").name == "orthogonal-30-25-20"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "flat",
        "cube:1,2,3",
        "flat:1,2",
        "flat:a,b,c",
        "flat:18,-14,10",
        "flat:18,nan,10",
        "flat:18,14,inf",
        "flat:1_8,14,10",
        "flat:\u0661\u0668,14,10",
    ],
)
def test_texts_that_describe_no_marker_are_refused(text: str) -> None:
    with pytest.raises(ParameterError):
        parse_marker(text)
