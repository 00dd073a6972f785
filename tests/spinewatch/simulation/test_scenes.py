import json
from pathlib import Path

import numpy as np
import pytest

from bench.truth import find_scenes
from spinewatch.geometry.rotations import rotation_from_angles
from spinewatch.simulation.observations import Noise
from spinewatch.simulation.rigs import large_rig, perturbed_rig, table_3_3_rig
from spinewatch.simulation.scenes import SceneParameters, aim_point, simulate_scene, truth_document


def test_the_truth_reads_like_that_of_rendered_scenes(tmp_path: Path) -> None:
    rig = table_3_3_rig()
    scene = simulate_scene(rig, SceneParameters(hidden=2), np.random.default_rng(3))
    (tmp_path / "s").mkdir()
    (tmp_path / "s" / "truth.json").write_text(json.dumps(truth_document(scene, "s")))
    (read,) = find_scenes(tmp_path)
    assert read.labels == ("L1", "T11", "T9", "T7")
    assert sum(not triad.visible for triad in read.triads) == 2
    for triad, pose in zip(read.triads, scene.poses, strict=True):
        assert triad.position_mm == pytest.approx(pose.position_mm)
        for name, views in triad.centre_px.items():
            ball = FLAT[name] @ pose.rotation.T + pose.position_mm
            assert views["left"] == pytest.approx(rig.left.project(ball))
            assert read.rig.right.project(ball) == pytest.approx(views["right"])


FLAT = dict(zip(("XX", "YY", "MX"), np.array([[18.0, 0, 0], [0, -14, 0], [-10, 0, 0]]), strict=True))


def test_the_same_seed_gives_the_same_scene() -> None:
    first, second = (
        truth_document(simulate_scene(large_rig(), SceneParameters(), np.random.default_rng(5)), "s")
        for _ in range(2)
    )
    assert first == second


def test_hidden_balls_have_no_feature_and_shared_errors_move_a_triad_as_one() -> None:
    parameters = SceneParameters(hidden=1, noise=Noise(0.0, 1.0, 0))
    scene = simulate_scene(large_rig(), parameters, np.random.default_rng(1))
    ((ball, side),) = scene.hidden
    assert ball not in getattr(scene.seen, f"{side}_ball")
    camera = scene.true_rig.left
    miss = np.full((12, 2), np.nan)
    for xy, number in zip(scene.seen.left.xy_px, scene.seen.left_ball, strict=True):
        pose = scene.poses[number // 3]
        balls = np.array(list(FLAT.values())) @ pose.rotation.T + pose.position_mm
        miss[number] = xy - camera.project(balls[number % 3])
    spread = [np.nanstd(miss[3 * t : 3 * t + 3], axis=0).max() for t in range(4)]
    assert max(spread) < 1e-9
    assert np.nanstd(miss) > 0.1


def test_a_perturbed_rig_is_the_rig_but_for_small_errors() -> None:
    rig, rng = large_rig(), np.random.default_rng(0)
    assert perturbed_rig(rig, rng, 0, 0) is rig
    other = perturbed_rig(rig, rng, 0.05, 0.1)
    assert other.left is rig.left
    assert 0 < np.linalg.norm(other.right.centre - rig.right.centre) < 0.6
    assert np.allclose(rotation_from_angles(*other.right.rotation_deg), other.right.M)
    assert np.abs(other.right.M - rig.right.M).max() < 0.005


def test_both_axes_pass_the_aim_point() -> None:
    rig = large_rig()
    target = aim_point(rig)
    for camera in (rig.left, rig.right):
        ideal = camera.M @ (target - camera.centre)
        assert np.abs(ideal[:2]).max() < 1e-9
