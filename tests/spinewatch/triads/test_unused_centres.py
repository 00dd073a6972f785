"""Centres that a person placed, and that no triad uses."""

from dataclasses import replace

import numpy as np

from spinewatch.detection.features import Features
from spinewatch.triads.pose import Ball, MeasuredTriad, Pose
from spinewatch.triads.unused_centres import unused_centre_flags

CENTRES = np.array([[100.0, 50.0], [120.0, 60.0], [140.0, 55.0]])
POSE = Pose(np.zeros(3), np.eye(3), np.eye(6))


def features(*manual: bool) -> Features:
    found = Features.with_sigma(CENTRES, np.array([1.0, 0.9, 0.8]), 0.1)
    return replace(found, manual=np.array(manual))


def triad(*balls: int, pose: Pose | None = POSE) -> MeasuredTriad:
    seen = {
        str(k): Ball(np.zeros(3), np.eye(3), CENTRES[k].copy(), None if k == 1 else CENTRES[k].copy(), None)
        for k in balls
    }
    return MeasuredTriad("flat", seen, pose, 0.0)


def test_a_centre_of_a_triad_is_used_and_detected_features_are_no_centres_of_a_person() -> None:
    pair = features(True, False, True), features(False, False, False)
    assert unused_centre_flags(pair, [triad(0, 1, 2)]) == ()


def test_a_centre_of_no_triad_is_flagged_with_its_place_and_image() -> None:
    pair = features(False, False, True), features(False, True, False)
    left, right = unused_centre_flags(pair, [triad(0, 1)])
    assert (left.code, right.code) == ("centre-unused", "centre-unused")
    assert "(140.0, 55.0) px in the left image" in left.detail
    assert "(120.0, 60.0) px in the right image" in right.detail  # the ball of the triad is hidden there


def test_a_triad_without_a_pose_uses_nothing() -> None:
    pair = features(True, False, False), features(False, False, False)
    assert len(unused_centre_flags(pair, [triad(0, 1, 2, pose=None)])) == 1
