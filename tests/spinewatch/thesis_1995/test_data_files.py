from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.detection.features import Features
from spinewatch.markers import FLAT_10_14_18
from spinewatch.simulation.rigs import large_rig
from spinewatch.thesis_1995.data_files import (
    DataFileError,
    FeatureList,
    MatchCoordinates,
    format_features,
    format_match_coordinates,
    format_residuals,
    format_triads,
    format_world_points,
    parse_features,
    parse_match_coordinates,
    parse_residuals,
    parse_triads,
    parse_world_points,
)
from spinewatch.thesis_1995.match_point import MatchPoint, MatchPointParameters, match_point

NUMBERS = st.floats(-999, 999)


def one_triad(labels: tuple[str, ...]) -> MatchPoint:
    rig, balls = large_rig(), FLAT_10_14_18.coordinates_mm + np.array([430.0, 390.0, 90.0])
    left, right = (
        Features.with_sigma(camera.project(balls), np.ones(3), 0.1) for camera in (rig.left, rig.right)
    )
    return match_point(left, right, rig, labels, MatchPointParameters())


@given(st.lists(st.tuples(NUMBERS, NUMBERS, st.floats(0, 1)), max_size=5))
def test_features_are_read_back(rows: list[tuple[float, float, float]]) -> None:
    table = np.array(rows).reshape(-1, 3)
    back = parse_features(format_features(FeatureList(table[:, :2], table[:, 2])))
    assert back.xy_px == pytest.approx(table[:, :2], abs=1e-4)
    assert back.score == pytest.approx(table[:, 2], abs=1e-6)


def test_pairs_are_read_back_with_features_that_count_from_one_in_the_file() -> None:
    pairs = MatchCoordinates(np.array([0, 2]), np.array([4, 0]), np.eye(2), 2 * np.eye(2))
    text = format_match_coordinates(pairs)
    assert text.splitlines()[1].startswith("1 1 5 ")
    back = parse_match_coordinates(text)
    assert back.left.tolist() == [0, 2]
    assert back.right.tolist() == [4, 0]
    assert back.right_mm == pytest.approx(2 * np.eye(2))


def test_points_residuals_and_triads_are_read_back() -> None:
    found = one_triad(("T9",))
    assert parse_world_points(format_world_points(found.points.position_mm)) == pytest.approx(
        found.points.position_mm, abs=1e-6
    )
    assert parse_residuals(format_residuals(found))[:, 0] == pytest.approx(found.points.parallax_mm, abs=1e-6)
    (record,) = parse_triads(format_triads(found))
    assert record.label == "T9"
    assert record.position_mm == pytest.approx([430, 390, 90], abs=1e-3)
    assert record.normal == pytest.approx([0, 0, 1], abs=1e-5)


def test_a_triad_without_a_label_stays_without_one() -> None:
    (record,) = parse_triads(format_triads(one_triad(("L1", "T9"))))
    assert record.label is None


@pytest.mark.parametrize(
    ("read", "text", "problem"),
    [
        (parse_features, "1 2\n", "line 1 has 2 entries"),
        (parse_features, "# a comment\n1 2 x 1\n", "line 2 contains 'x', which is not a number"),
        (parse_features, "1 2 nan 1\n", "not finite"),
        (parse_features, "1 2_0 3 1\n", "'2_0', which has an underscore"),
        (parse_world_points, "1 2 3\n", "number X_mm Y_mm Z_mm"),
        (parse_match_coordinates, "1 0 1 0 0 0 0\n", "whole numbers from 1"),
        (parse_match_coordinates, "1 1.5 1 0 0 0 0\n", "whole numbers from 1"),
        (parse_residuals, "1\n", "has 1 entries"),
        (parse_triads, "1 T9 0 0 0 0 0 1\n", "line 1 has"),
    ],
)
def test_other_text_is_refused_with_its_line(read: Callable[[str], object], text: str, problem: str) -> None:
    with pytest.raises(DataFileError, match=problem):
        read(text)
