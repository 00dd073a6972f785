"""Triads that edits moved."""

from dataclasses import replace

import numpy as np

from spinewatch.arrays import Float
from spinewatch.triads.moved_triads import EarlierTriad, moved_triad_flags
from spinewatch.triads.pose import Ball, MeasuredTriad, Pose

LEFT = np.array([[100.0, 100.0], [140.0, 100.0], [110.0, 130.0]])
RIGHT = LEFT + 40


def pose(z_mm: float, sd_mm: float = 0.5) -> Pose:
    return Pose(np.array([0.0, 0.0, z_mm]), np.eye(3), sd_mm**2 * np.eye(6))


def earlier(left: Float = LEFT, right: Float = RIGHT) -> EarlierTriad:
    return EarlierTriad(pose(0.0), {"left": left, "right": right})


def edited(z_mm: float, shift_px: float = 8.0, *, manual: bool = True, sd_mm: float = 0.5) -> MeasuredTriad:
    balls = {
        name: Ball(
            np.zeros(3),
            np.eye(3),
            LEFT[k] + np.array([shift_px, 0]),
            RIGHT[k],
            0.0,
            ("left",) if manual else (),
        )
        for k, name in enumerate(("XX", "YY", "MX"))
    }
    return MeasuredTriad("flat-10-14-18", balls, pose(z_mm, sd_mm), 0.0)


def test_a_triad_that_an_edit_moves_far_is_flagged_with_the_distance() -> None:
    (flag,) = moved_triad_flags([earlier()], [edited(11.0)])
    assert flag.code == "triad-moved-by-edit"
    assert "moved it by 11.0 mm, 16 sd" in flag.detail


def test_a_move_within_the_deviations_is_none() -> None:
    assert moved_triad_flags([earlier()], [edited(3.0)]) == ()
    assert moved_triad_flags([earlier()], [edited(11.0, sd_mm=5.0)]) == ()


def test_only_the_same_triad_with_a_placed_centre_counts() -> None:
    assert moved_triad_flags([earlier()], [edited(11.0, manual=False)]) == ()
    assert moved_triad_flags([earlier(LEFT + 200, RIGHT + 200)], [edited(11.0)]) == ()
    assert moved_triad_flags([earlier()], [replace(edited(11.0), pose=None)]) == ()
