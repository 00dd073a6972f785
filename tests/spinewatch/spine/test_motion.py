import json
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.spine.motion import ReferenceMissingError, relative_motion, relative_pose
from spinewatch.triads.pose import Pose
from tests.paths import DATA

SURGERY = json.loads((DATA / "surgery_motion.json").read_text())
seeds = st.integers(0, 2**32 - 1)


def pose(P: Any, R: Any, covariance: Float | None = None) -> Pose:
    return Pose(np.array(P), np.array(R), np.zeros((6, 6)) if covariance is None else covariance)


def stage(name: str) -> dict[str, Pose]:
    return {v: pose(t["P_mm"], t["rotation"]) for v, t in SURGERY["stages"][name].items()}


def random_pose(rng: np.random.Generator) -> Pose:
    A = rng.normal(0, 0.2, (6, 6))
    return pose(rng.uniform(-200, 200, 3), Rotation.random(rng=rng).as_matrix(), A @ A.T)


@pytest.mark.parametrize("name", ["INTER", "POST"])
def test_motion_agrees_with_the_rendered_surgery(name: str) -> None:
    motions = relative_motion(stage("PRE"), stage(name), SURGERY["reference"])
    assert [m.vertebra for m in motions] == ["T11", "T9", "T7"]
    for motion in motions:
        truth = SURGERY["motion_from_PRE"][name][motion.vertebra]
        assert np.allclose(motion.rotation, truth["R"], atol=1e-9)
        assert np.allclose(motion.rotation_vector_deg, truth["rotvec_deg"], atol=1e-7)
        assert np.allclose(motion.translation_mm, truth["dP_mm"], atol=1e-9)
        assert motion.angle_deg == pytest.approx(truth["angle_deg"], abs=1e-7)
        assert motion.normal_angle_deg == pytest.approx(truth["normal_angle_deg"], abs=1e-6)


@settings(deadline=None)
@given(seeds)
def test_moving_the_cart_moves_nothing(seed: int) -> None:
    rng = np.random.default_rng(seed)
    start = {v: random_pose(rng) for v in ("L1", "T11", "T9")}
    R, t = Rotation.random(rng=rng).as_matrix(), rng.uniform(-300, 300, 3)
    end = {v: pose(R @ p.position_mm + t, R @ p.rotation) for v, p in start.items()}
    motions = relative_motion(start, end, "L1")
    assert [motion.vertebra for motion in motions] == ["T11", "T9"]
    for motion in motions:
        assert np.allclose(motion.translation_mm, 0, atol=1e-9)
        assert motion.angle_deg == pytest.approx(0, abs=1e-6)


def test_a_coronal_rotation_does_not_change_the_normal() -> None:
    flat = {"L1": pose([0, 0, 0], np.eye(3)), "T9": pose([100, 0, 0], np.eye(3))}
    turned = dict(flat, T9=pose([100, 0, 0], rotation_from_vector(np.radians([0.0, 0.0, 25.0]))))
    (motion,) = relative_motion(flat, turned, "L1")
    assert motion.angle_deg == pytest.approx(25)
    assert motion.normal_angle_deg == pytest.approx(0, abs=1e-9)
    assert np.allclose(motion.rotation_vector_deg, [0, 0, 25])


def disturbed(p: Pose, rng: np.random.Generator) -> Pose:
    e = np.linalg.cholesky(p.covariance) @ rng.standard_normal(6)
    return Pose(p.position_mm + e[:3], rotation_from_vector(np.radians(e[3:])) @ p.rotation, p.covariance)


def test_errors_fit_the_deviations_which_include_the_reference() -> None:
    rng = np.random.default_rng(3)
    start, end = ({v: random_pose(rng) for v in ("L1", "T9")} for _ in range(2))
    near = rotation_from_vector(np.radians([20.0, -30.0, 10.0]))
    relative = start["L1"].rotation.T @ start["T9"].rotation
    end["T9"] = Pose(end["T9"].position_mm, end["L1"].rotation @ near @ relative, end["T9"].covariance)
    (truth,) = relative_motion(start, end, "L1")
    sample = [
        relative_motion(
            {v: disturbed(p, rng) for v, p in start.items()},
            {v: disturbed(p, rng) for v, p in end.items()},
            "L1",
        )[0]
        for _ in range(1500)
    ]
    for value, sd in (
        ("translation_mm", "translation_sd_mm"),
        ("rotation_vector_deg", "rotation_sd_deg"),
        ("angle_deg", "angle_sd_deg"),
        ("normal_angle_deg", "normal_angle_sd_deg"),
    ):
        spread = np.std([getattr(m, value) for m in sample], axis=0)
        assert np.allclose(spread, getattr(truth, sd), rtol=0.08)
    assert truth.angle_deg == pytest.approx(np.degrees(np.linalg.norm(np.radians([20, -30, 10]))))
    for value, ends in (
        ("angle_deg", "angle_interval_deg"),
        ("normal_angle_deg", "normal_angle_interval_deg"),
    ):
        inside = [getattr(m, ends)[0] <= getattr(truth, value) <= getattr(m, ends)[1] for m in sample]
        assert 0.93 <= np.mean(inside) <= 0.97


def test_a_pose_relative_to_itself_is_the_identity() -> None:
    p = random_pose(np.random.default_rng(1))
    own = relative_pose(p, p)
    assert np.allclose(own.position_mm, 0)
    assert np.allclose(own.rotation, np.eye(3))


def test_no_rotation_still_has_a_deviation() -> None:
    p = {"L1": pose([0, 0, 0], np.eye(3), np.eye(6)), "T9": pose([50, 0, 0], np.eye(3), np.eye(6))}
    (motion,) = relative_motion(p, p, "L1")
    assert motion.angle_deg == 0
    assert motion.angle_sd_deg == pytest.approx(2)  # reference and vertebra, before and after
    assert motion.normal_angle_sd_deg == pytest.approx(2)
    assert motion.angle_interval_deg == pytest.approx((0, 2 * 1.96), abs=0.01)
    assert motion.normal_angle_interval_deg == pytest.approx((0, 2 * 1.96), abs=0.01)


@pytest.mark.parametrize(("lacking", "named"), [("PRE", "start"), ("POST", "end")])
def test_without_the_reference_there_is_no_motion(lacking: str, named: str) -> None:
    stages = {"PRE": stage("PRE"), "POST": stage("POST")}
    del stages[lacking]["L1"]
    with pytest.raises(ReferenceMissingError, match=f"L1 .* {named}"):
        relative_motion(stages["PRE"], stages["POST"], "L1")


def test_only_vertebrae_of_both_stages_are_listed() -> None:
    end = stage("POST")
    del end["T11"]
    assert [m.vertebra for m in relative_motion(stage("PRE"), end, "L1")] == ["T9", "T7"]
