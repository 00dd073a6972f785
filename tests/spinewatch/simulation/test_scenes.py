import json
from pathlib import Path

import numpy as np
import pytest

from bench.truth import find_scenes
from spinewatch.markers import FLAT_10_14_18
from spinewatch.simulation.rigs import convergence_point, large_rig, table_3_3_rig
from spinewatch.simulation.scenes import SceneParameters, simulate_scene, truth_document


def test_the_truth_has_the_format_of_rendered_scenes(tmp_path: Path) -> None:
    rig = table_3_3_rig()
    scene = simulate_scene(rig, SceneParameters(hidden=2), np.random.default_rng(3))
    (tmp_path / "s").mkdir()
    (tmp_path / "s" / "truth.json").write_text(json.dumps(truth_document(scene, "s")))
    (read,) = find_scenes(tmp_path)
    assert read.labels == ("L1", "T11", "T9", "T7")
    assert sum(not triad.visible for triad in read.triads) == 2
    balls = dict(zip(FLAT_10_14_18.balls, FLAT_10_14_18.coordinates_mm, strict=True))
    for triad, pose in zip(read.triads, scene.poses, strict=True):
        assert triad.position_mm == pytest.approx(pose.position_mm)
        for name, views in triad.centre_px.items():
            ball = balls[name] @ pose.rotation.T + pose.position_mm
            assert views["left"] == pytest.approx(rig.left.project(ball))
            assert read.rig.right.project(ball) == pytest.approx(views["right"])


def test_the_same_seed_gives_the_same_scene() -> None:
    first, second = (
        truth_document(simulate_scene(large_rig(), SceneParameters(), np.random.default_rng(5)), "s")
        for _ in range(2)
    )
    assert first == second


def test_a_scene_is_around_the_convergence_point() -> None:
    rig = large_rig()
    scene = simulate_scene(rig, SceneParameters(axis="y"), np.random.default_rng(1))
    mean = np.mean([pose.position_mm for pose in scene.poses], axis=0)
    assert np.abs(mean - convergence_point(rig)).max() < 20


def test_each_hidden_ball_belongs_to_another_triad() -> None:
    scene = simulate_scene(large_rig(), SceneParameters(hidden=9), np.random.default_rng(1))
    assert [ball // 3 for ball, _ in scene.hidden] == [0, 1, 2, 3]
    for ball, side in scene.hidden:
        assert ball not in getattr(scene.observation, f"{side}_ball")


def test_the_calibration_error_is_in_the_rig_to_measure_with_only() -> None:
    rig = large_rig()
    parameters = SceneParameters(calibration_sd_deg=0.1, calibration_sd_mm=0.1)
    scene = simulate_scene(rig, parameters, np.random.default_rng(1))
    assert scene.true_rig is rig
    assert scene.rig.name == f"{rig.name} (perturbed)"
    exact = simulate_scene(rig, SceneParameters(), np.random.default_rng(1))
    assert exact.rig is rig
    assert np.array_equal(exact.observation.left.xy_px, scene.observation.left.xy_px)
