"""Flags of centres that a person placed far from what was detected."""

import numpy as np

from spinewatch.arrays import Float
from spinewatch.detection.features import Features
from spinewatch.detection.refinement.centre_parameters import CentreParameters
from spinewatch.flags import Flag
from spinewatch.triads.placed_centres import compare_placed_centres
from spinewatch.triads.pose import Ball, MeasuredTriad, Pose

NAMES = ("XX", "YY", "MX")
BALLS = np.array([[100.0, 100.0], [140.0, 100.0], [110.0, 130.0]])
P = CentreParameters()
SIZE = (10.0, 10.0)


def triad(left: Float, manual: str = "XX YY MX", *, posed: bool = True) -> MeasuredTriad:
    balls = {
        name: Ball(np.zeros(3), np.eye(3), xy, xy + 50, 0.0, ("left",) if name in manual.split() else ())
        for name, xy in zip(NAMES, left, strict=True)
    }
    pose = Pose(np.zeros(3), np.eye(3), np.eye(6)) if posed else None
    return MeasuredTriad("flat-10-14-18", balls, pose, 0.0)


def compared(*triads: MeasuredTriad) -> tuple[tuple[MeasuredTriad, ...], tuple[Flag, ...]]:
    features = Features.with_sigma(BALLS, np.full(3, 0.9), 0.1)
    return compare_placed_centres(triads, (features, None), (SIZE, SIZE), P)


def test_three_centres_displaced_together_raise_one_flag_with_the_distances() -> None:
    (after,), (flag,) = compared(triad(BALLS + np.array([8.0, 0])))
    assert flag.code == "centre-displaced"
    assert "left image: all placed centres are displaced together" in flag.detail
    assert "XX by 8.0 px, 13 sd" in flag.detail
    assert [ball.placed["left"].distance_px for ball in after.balls.values()] == [8.0] * 3
    assert "right" not in after.balls["XX"].placed


def test_centres_on_what_was_detected_are_compared_and_not_flagged() -> None:
    (after,), flags = compared(triad(BALLS + np.array([0.5, 0])))
    assert flags == ()
    assert after.balls["XX"].placed["left"].distance_px == 0.5


def test_a_small_displacement_is_flagged_only_if_it_is_common() -> None:
    assert [flag.code for flag in compared(triad(BALLS + np.array([1.8, 0])))[1]] == ["centre-displaced"]
    one = BALLS + np.array([[1.8, 0], [0, 0], [0, 0]])
    assert compared(triad(one, "XX"))[1] == ()


def test_a_ball_that_was_not_detected_is_no_doubt_although_another_ball_is_near() -> None:
    hidden = BALLS.copy()
    hidden[1] = BALLS[0] + np.array([9.0, 0])  # beside XX, which was detected and is used
    (after,), flags = compared(triad(hidden, "YY"))
    assert flags == ()
    assert after.balls["YY"].placed["left"].feature_px is None


def test_triads_without_pose_and_images_without_edits_are_left_alone() -> None:
    assert compared(triad(BALLS + np.array([8.0, 0]), posed=False))[1] == ()
    before = (triad(BALLS + np.array([8.0, 0])),)
    assert compare_placed_centres(before, (None, None), (SIZE, SIZE), P) == (before, ())
