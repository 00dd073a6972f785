"""The detection benchmark's own figures, on simulated detectors and errors of known score."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from bench import detection
from bench.balls import BallScene, find_ball_scenes
from bench.contenders import Contender, Positions, find_balls
from bench.detection_cost import SIZES, enlarge
from bench.detection_scoring import BallErrors, FoundScene, centre_errors, centres, nearest, score
from bench.peers_detection import PEERS, Detector
from tests.paths import SAMPLES

SHIFT = np.array([0.3, -0.4])


@pytest.fixture(scope="module")
def scenes() -> list[BallScene]:
    return list(find_ball_scenes(SAMPLES))


def test_a_detector_is_scored_by_its_list(scenes: list[BallScene]) -> None:
    nowhere = np.full((15, 2), -100.0)

    def shifted(scene: BallScene, budget: int) -> Positions:
        left, right = (np.concatenate([nowhere, v.centres_px[v.visible] + SHIFT]) for v in scene.views)
        return left, right

    found = score(Contender(shifted), scenes)
    assert found.recall == pytest.approx((5 / 12, 1, 1, 1))
    assert found.rms_px == pytest.approx((0.3, 0.4))
    assert found.features == 27


def test_unranked_detectors_run_for_every_budget(scenes: list[BallScene]) -> None:
    budgets: list[int] = []

    def none_at_twenty(scene: BallScene, budget: int) -> Positions:
        budgets.append(budget)
        left, right = (v.centres_px if budget > 20 else np.empty((0, 2)) for v in scene.views)
        return left, right

    found = score(Contender(none_at_twenty, ranked=False), scenes[:1])
    assert set(budgets) == {20, 40, 60, 100}
    assert found.recall == (0, 1, 1, 1)


def test_without_features_offsets_are_infinite() -> None:
    offset, index = nearest(np.zeros((2, 2)), np.empty((0, 2)))
    assert np.isinf(offset).all()
    assert index.tolist() == [0, 0]


def test_centres_with_correct_deviations_have_a_chi_square_of_one() -> None:
    rng = np.random.default_rng(0)
    n = 20_000
    sd = np.full((n, 2), 0.1)
    sd[: n // 4] = 0.3
    error = sd * rng.normal(size=(n, 2)) + (0.05, 0)
    everywhere = np.ones(n, dtype=bool)
    row = centres(BallErrors(error, sd, everywhere, everywhere))
    assert row.sure_share == pytest.approx(0.75)
    assert row.bias_px == pytest.approx((0.05, 0), abs=0.004)
    assert row.rms_px == pytest.approx((np.hypot(0.1, 0.05), 0.1), rel=0.02)
    assert row.chi2 == pytest.approx(1 + 0.25 / 2, rel=0.03)


def test_missed_balls_are_not_sure(scenes: list[BallScene]) -> None:
    found = FoundScene(scenes[0], *find_balls(scenes[0]))
    left = found.left.features
    far = type(left)(left.xy_px + 5, left.score, left.covariance_px2)
    missed = FoundScene(
        scenes[0], type(found.left)(far, found.left.field, found.left.exposure, ()), found.right
    )
    assert centres(centre_errors([found]).of_side("left")).sure_share == 1
    assert centres(centre_errors([missed]).of_side("left")).sure_share < 0.5
    assert centres(centre_errors([missed]).of_side("right")).sure_share == 1


@pytest.mark.parametrize("size", SIZES)
def test_an_enlarged_view_fits_its_camera(scenes: list[BallScene], size: tuple[int, int]) -> None:
    small, large = scenes[0].left, enlarge(scenes[0], size).left
    assert large.image.shape == size[::-1]
    pixels = large.camera.pixels(small.camera.plate(small.centres_px))
    np.testing.assert_allclose(pixels, large.centres_px, atol=1e-9)


@pytest.mark.parametrize("detector", PEERS.values(), ids=list(PEERS))
def test_peers_find_dark_discs_on_a_plain_ground(detector: Detector) -> None:
    y, x = np.mgrid[:160, :200]
    centres = np.array([[40.0, 40.0], [100.3, 60.6], [160.5, 110.2]])
    distance = [np.hypot((x - u) / 4.5, (y - v) / 5.3) for u, v in centres]
    image = (150 - 130 / (1 + np.exp(6 * (np.min(distance, axis=0) - 1)))).astype(np.float32)
    offset, _ = nearest(centres, detector(image, (9.0, 10.6))[:20])
    assert np.linalg.norm(offset, axis=1).max() < 1.5


def test_the_benchmark_prints_every_table_and_checks_its_bars(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copytree(SAMPLES / "D1" / "PRE", tmp_path / "D1" / "PRE")
    shutil.copy(SAMPLES / "D1" / "rig.json", tmp_path / "D1")
    file = tmp_path / "figures.json"
    monkeypatch.setattr(detection, "FASTER", float("inf"))
    assert detection.main([str(tmp_path), "--runs", "1", "--json", str(file), "--check"]) == 1
    printed = capsys.readouterr().out
    for title in ("Detectors", "Centres", "Scenes", "Image size", "Memory", "Bars", "MISSED"):
        assert title in printed
    figures = json.loads(file.read_text())
    assert figures["recall"]["Spinewatch"]["60"] == 1
    assert figures["centres"]["both views"]["sure"] == 24
    assert 0 < figures["cost"]["memory_mb"] < 1000


def test_folders_without_truth_are_refused(tmp_path: Path) -> None:
    with pytest.raises(SystemExit) as stop:
        detection.main([str(tmp_path)])
    assert stop.value.code == 2
