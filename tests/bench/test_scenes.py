"""Figures of the benchmark on constructed measurements whose scores are known."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench import accuracy, scenes, speed
from bench.scoring import score_motion, score_stage, summary, uncertainty_scores
from bench.truth import Scene, TrueTriad, find_scenes, read_surgery
from spinewatch.detection.candidates.search import Detection
from spinewatch.detection.candidates.surgical_field import SurgicalField
from spinewatch.detection.features import Features
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.imaging.exposure import Exposure
from spinewatch.imaging.frame import SIDES
from spinewatch.parameters import Parameters
from spinewatch.stage import StageMeasurement
from spinewatch.triads.labels import LabelledTriad
from spinewatch.triads.pose import Ball, MeasuredTriad, Pose
from tests.paths import SAMPLES

EYE = np.diag([0.01] * 3 + [1.0] * 3)


def sample(stage: str) -> Scene:
    return next(scene for scene in find_scenes(SAMPLES) if scene.folder.name == stage)


def measured(
    truth: TrueTriad, shift_mm: float = 0, rotation_deg: float = 0, label: str | None = ""
) -> LabelledTriad:
    balls = {
        name: Ball(np.zeros(3), np.eye(3), views["left"], views["right"], 0.0)
        for name, views in truth.centre_px.items()
    }
    rotation = rotation_from_vector(np.radians([0.0, 0.0, rotation_deg]))
    pose = Pose(truth.position_mm + np.array([shift_mm, 0, 0]), rotation @ truth.rotation, EYE)
    name = truth.vertebra if label == "" else label
    return LabelledTriad(name, None, MeasuredTriad("flat", balls, pose, 0.1))


def stage(scene: Scene, triads: Sequence[LabelledTriad]) -> StageMeasurement:
    def view(side: str) -> Detection:
        centres = [triad.centre_px[ball][side] for triad in scene.triads for ball in triad.visible_in[side]]
        features = Features.with_sigma(np.array(centres)[1:], np.ones(len(centres) - 1), 0.1)
        return Detection(features, SurgicalField(0, 0, 568, 416), Exposure.NORMAL, ())

    return StageMeasurement(view("left"), view("right"), tuple(triads), (), None, Parameters(), "test")


def test_sample_truth_agrees_with_its_cameras() -> None:
    scenes = list(find_scenes(SAMPLES))
    assert [len(scene.triads) for scene in scenes] == [4, 4, 4]
    for scene in scenes:
        for triad in scene.triads:
            legs = {"XX": [18, 0, 0], "YY": [0, -14, 0], "MX": [-10, 0, 0]}
            for ball, leg in legs.items():
                centre = triad.position_mm + triad.rotation @ leg
                for side in SIDES:
                    camera = scene.rig.left if side == "left" else scene.rig.right
                    np.testing.assert_allclose(camera.project(centre), triad.centre_px[ball][side], atol=1e-6)


def test_found_missed_mislabelled_and_false() -> None:
    scene = sample("PRE")
    a, b, c, d = scene.triads
    far = replace(d, position_mm=d.position_mm + np.array([0, 0, 50]))
    triads = [measured(a), measured(b, shift_mm=3), measured(c, label=None), measured(far, label="T7")]
    score = score_stage(scene, stage(scene, triads), 12.0)
    assert [match.found for match in score.matches] == [True, False, False, False]
    assert [match.labelled_correctly for match in score.matches] == [True, True, False, False]
    assert score.false == 1
    figures = summary([score], [])
    assert (figures["found"], figures["visible"], figures["mislabelled"], figures["false"]) == (1, 4, 1, 1)
    assert figures["feature_recall"] == pytest.approx(11 / 12)
    assert figures["ms_median"] == 12.0


def test_errors_are_in_mm_and_degrees_with_chi_squares_of_the_covariance() -> None:
    scene = sample("PRE")
    score = score_stage(
        scene, stage(scene, [measured(t, shift_mm=0.2, rotation_deg=2) for t in scene.triads]), 1.0
    )
    figures = summary([score], [])
    assert figures["P_rms_mm"] == pytest.approx(0.2)
    assert figures["rot_rms_deg"] == pytest.approx(2)
    for match in score.matches:
        assert match.chi2 == pytest.approx((4.0, 4.0))


def test_exact_poses_reproduce_the_true_motion() -> None:
    surgery = read_surgery(SAMPLES / "D1")
    assert surgery is not None
    stages = {}
    for name in ("PRE", "INTER", "POST"):
        scene = sample(name)
        stages[name] = score_stage(scene, stage(scene, [measured(t) for t in scene.triads]), 1.0)
    motions = score_motion(stages, surgery)
    assert len(motions) == 6
    assert max(motion.translation_mm for motion in motions) < 1e-6
    assert max(np.abs(motion.rotation_deg).max() for motion in motions) < 1e-6


def test_correct_deviations_score_one() -> None:
    errors = np.random.default_rng(0).normal(size=(20_000, 3))
    right, small = (
        uncertainty_scores((errors**2).sum(axis=1)),
        uncertainty_scores((errors**2).sum(axis=1) * 4),
    )
    assert right["mean"] == pytest.approx(1, abs=0.03)
    assert right["median"] == pytest.approx(1, abs=0.03)
    assert right["within95_pct"] == pytest.approx(95, abs=1)
    assert small["mean"] == pytest.approx(4, abs=0.1)
    assert small["within95_pct"] < 70


def test_bars_are_missed_by_errors_and_say_where_the_sample_is_too_small() -> None:
    scene = sample("PRE")
    good = score_stage(scene, stage(scene, [measured(t, shift_mm=0.1) for t in scene.triads]), 1.0)
    far = score_stage(scene, stage(scene, [measured(t, shift_mm=0.4) for t in scene.triads]), 1.0)
    few, many, off = (
        {bar.promise: bar for bar in scenes.scene_bars(summary(scores, []))}
        for scores in ([good], [good] * 15, [far] * 15)
    )
    position, covered = "P <= 0.25 mm RMS", "95% regions of P and rotation cover 90 to 98%"
    assert few[position].holds
    assert "not judged: 4 of at least 8" in few[position].reached
    assert "not judged" in few[covered].reached
    assert many[position].holds
    assert not many[covered].holds
    assert not off[position].holds


def test_scenes_check_passes_on_the_sample(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert scenes.main([str(SAMPLES), "--check", "--json", str(tmp_path / "figures.json")]) == 0
    out = capsys.readouterr().out
    assert "D1/INTER" in out
    assert "MISSED" not in out
    figures = json.loads((tmp_path / "figures.json").read_text())["all"]
    assert (figures["found"], figures["visible"], figures["false"]) == (12, 12, 0)
    assert figures["partial"] == 0


def test_scenes_without_truth_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SystemExit) as stop:
        scenes.main([str(tmp_path)])
    assert stop.value.code == 2


def test_speed_prints_all_contenders(capsys: pytest.CaptureFixture[str]) -> None:
    assert speed.main(["--runs", "2"]) == 0
    out = capsys.readouterr().out
    assert "one pair" in out
    assert "prepared measurer" in out
    assert "masked matchTemplate" in out


def test_accuracy_document_holds_every_table(tmp_path: Path) -> None:
    page = tmp_path / "accuracy.md"
    accuracy.main([str(SAMPLES), "--out", str(page), "--runs", "2"])
    text = page.read_text()
    for title in ("Pairs", "Summary", "Stated uncertainty", "Bars", "One pair of 568 x 416", "Steps"):
        assert f"**{title}" in text
    assert "| D1/POST | normal |" in text
