import numpy as np
import pytest

from spinewatch.markers import FLAT_10_14_18
from spinewatch.planning.accuracy import expected_poses, straight_chain
from spinewatch.planning.depth_range import accuracy_over_depth, pixel_mm
from spinewatch.planning.planned_rig import planned_rig

RIG = planned_rig()
MIDDLE = straight_chain(("T9",), np.zeros(3), 50.0)[0]


def test_at_height_zero_it_is_the_accuracy_of_the_pose_itself() -> None:
    depth = accuracy_over_depth(RIG, FLAT_10_14_18, MIDDLE, (0.0,), 0.1, 0.08)[0]
    pose = expected_poses(RIG, FLAT_10_14_18, [MIDDLE], 0.1, 0.08)[0]
    assert np.allclose(depth.position_sd_mm, pose.position_sd_mm)
    assert np.allclose(depth.rotation_sd_deg, pose.rotation_sd_deg)


def test_errors_grow_away_from_the_cameras_and_are_largest_along_the_line_of_sight() -> None:
    depths = accuracy_over_depth(RIG, FLAT_10_14_18, MIDDLE, (-100.0, 0.0, 100.0), 0.1)
    largest = [depth.largest_sd_mm for depth in depths]
    assert largest == sorted(largest, reverse=True)
    for depth in depths:
        assert depth.largest_direction[2] > 0.95
        assert depth.largest_sd_mm >= depth.position_sd_mm.max()
        assert np.linalg.norm(depth.largest_direction) == pytest.approx(1)


def test_a_pixel_is_as_wide_as_similar_triangles_say() -> None:
    slant = np.hypot(736.0, 211.0)
    assert pixel_mm(RIG, np.zeros(3)) == pytest.approx(slant * 0.01 / 7.7)


def test_a_triad_outside_the_images_is_not_in_view() -> None:
    depths = accuracy_over_depth(planned_rig(focal_length_mm=30.0), FLAT_10_14_18, MIDDLE, (0.0, 300.0), 0.1)
    assert [depth.in_view for depth in depths] == [True, False]
