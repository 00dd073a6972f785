from collections.abc import Callable

import numpy as np
import pytest

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.spine.plausibility import plausibility_flags, shared_motion
from spinewatch.triads.pose import Pose

LEVELS = {"L1": 0.0, "T11": 54.0, "T9": 108.0, "T7": 160.0}
COVARIANCE = np.diag([0.04, 0.04, 0.09, 0.8, 0.8, 0.1])
Poses = dict[str, Pose]


def turn(*degrees: float) -> Float:
    return rotation_from_vector(np.radians(degrees))


def moved(pose: Pose, R: Float, about: Float, shift: Float | None = None) -> Pose:
    t = np.zeros(3) if shift is None else shift
    return Pose(R @ (pose.position_mm - about) + about + t, R @ pose.rotation, pose.covariance)


@pytest.fixture
def before() -> Poses:
    rng = np.random.default_rng(3)
    return {
        name: Pose(np.array([x, 0.0, 10.0]), rotation_from_vector(0.3 * rng.normal(size=3)), COVARIANCE)
        for name, x in LEVELS.items()
    }


def codes(before: Poses, after: Poses, reference: str = "L1") -> list[str]:
    return [flag.code for flag in plausibility_flags(before, after, reference)]


def test_a_turned_rig_raises_nothing(before: Poses) -> None:
    R = turn(5, -8, 10)
    after = {
        name: moved(pose, R, np.array([40.0, 5, 7]), np.array([80.0, -30, 20]))
        for name, pose in before.items()
    }
    assert codes(before, after) == []


def test_an_ordinary_correction_raises_nothing(before: Poses) -> None:
    # each level turns by 2.5 degrees against the one below, in the plane of the bed
    after = {
        name: moved(pose, turn(0, 0, 5 * i), before["L1"].position_mm)
        for i, (name, pose) in enumerate(before.items())
    }
    assert codes(before, after) == []


def test_a_reference_that_slipped_is_seen_in_the_motion_of_all_others(before: Poses) -> None:
    after = before | {
        "L1": moved(before["L1"], turn(0, 6, 5), before["L1"].position_mm, np.array([0.0, 2, 1]))
    }
    (flag,) = plausibility_flags(before, after, "L1")
    assert flag.code == "reference-moved"
    assert "2.2 mm and 7.8 degrees against T7, T9, T11" in flag.detail


def test_others_that_move_among_each_other_do_not_accuse_the_reference(before: Poses) -> None:
    after = before | {
        "T9": moved(before["T9"], turn(0, 0, 12), before["T9"].position_mm),
        "T7": moved(before["T7"], turn(0, 0, 18), before["T9"].position_mm),
    }
    assert "reference-moved" not in codes(before, after)


def test_a_motion_of_the_reference_within_the_noise_raises_nothing(before: Poses) -> None:
    after = before | {"L1": moved(before["L1"], turn(0.5, 0.5, 0.2), before["L1"].position_mm)}
    assert codes(before, after) == []


def test_a_distance_that_grows_by_a_fifth_is_flagged(before: Poses) -> None:
    after = before | {
        name: moved(before[name], np.eye(3), np.zeros(3), np.array([12.0, 0, 0]))
        for name in ("T11", "T9", "T7")
    }
    found = plausibility_flags(before, after, "L1")
    assert "intervertebral-distance-implausible" in [flag.code for flag in found]
    assert any("54.0 mm apart and are 66.0 mm apart, a change of +22%" in flag.detail for flag in found)


def test_neighbours_that_turn_by_forty_degrees_are_flagged(before: Poses) -> None:
    after = before | {"T11": moved(before["T11"], turn(0, 40, 0), before["T11"].position_mm)}
    found = codes(before, after)
    assert found.count("intervertebral-rotation-implausible") == 2
    assert "neighbours-disagree" in found


def test_a_marker_that_moved_alone_disagrees_with_its_neighbours(before: Poses) -> None:
    after = before | {"T9": moved(before["T9"], turn(0, 0, 29), before["T9"].position_mm)}
    assert codes(before, after) == ["neighbours-disagree"]


def test_neighbours_may_disagree_by_more_the_farther_they_are(before: Poses) -> None:
    # The middle one of three turns: limits are 20 degrees between T9 and L1, and 58 degrees between T4 and L4.
    renamed = {"T4": before["T9"], "T11": before["T11"], "L4": before["L1"]}
    middle = before["T11"]
    flagged = []
    for degrees in (35, 75):
        turned = {"T11": moved(middle, turn(0, degrees, 0), middle.position_mm)}
        flagged.append(
            [
                "neighbours-disagree" in codes(poses, poses | turned, reference)
                for poses, reference in ((before, "L1"), (renamed, "L4"))
            ]
        )
    assert flagged == [[True, False], [True, True]]


def test_uncertain_poses_raise_nothing(before: Poses) -> None:
    vague = {name: Pose(p.position_mm, p.rotation, 400 * COVARIANCE) for name, p in before.items()}
    after = vague | {"T11": moved(vague["T11"], turn(0, 40, 0), vague["T11"].position_mm)}
    assert codes(vague, after) == []


def test_poses_without_errors_are_compared_too(before: Poses) -> None:
    exact = {name: Pose(p.position_mm, p.rotation, np.zeros((6, 6))) for name, p in before.items()}
    assert codes(exact, exact) == []
    after = exact | {"L1": moved(exact["L1"], turn(0, 6, 5), exact["L1"].position_mm)}
    assert codes(exact, after) == ["reference-moved"]


def test_missing_triads_raise_nothing(before: Poses) -> None:
    only: Callable[[str], Poses] = lambda name: {name: before[name]}  # noqa: E731
    assert codes(only("L1"), only("T9")) == []
    assert codes({}, before) == []


def test_the_shared_motion_is_found_with_its_deviation() -> None:
    rng = np.random.default_rng(11)
    R, centre = turn(3, -4, 6), np.array([80.0, 0, 10])
    truth = [
        Pose(np.array([x, 0.0, 10]), rotation_from_vector(rng.normal(size=3)), COVARIANCE)
        for x in LEVELS.values()
    ]
    L = np.linalg.cholesky(COVARIANCE)
    squares, misfits = [], []
    for _ in range(200):
        noisy = []
        for poses in (truth, [moved(pose, R, centre, np.array([1.0, 2, 3])) for pose in truth]):
            errors = [L @ rng.normal(size=6) for _ in poses]
            noisy.append([
                Pose(p.position_mm + e[:3], turn(*e[3:]) @ p.rotation, COVARIANCE)
                for p, e in zip(poses, errors, strict=True)
            ])  # fmt: skip
        found = shared_motion(*noisy)
        true_shifted = R @ (found.centre_mm - centre) + centre + [1, 2, 3]
        turned = found.rotation @ R.T
        angle = (
            np.degrees(
                [turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]]
            )
            / 2
        )
        error = np.concatenate([found.shifted_mm - true_shifted, angle])
        squares.append(error @ np.linalg.solve(found.covariance, error))
        misfits.append(found.reduced_chi_square)
    assert np.mean(squares) / 6 == pytest.approx(1.0, abs=0.15)
    assert np.mean(misfits) == pytest.approx(1.0, abs=0.1)
