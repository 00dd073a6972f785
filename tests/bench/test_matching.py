from dataclasses import replace

import numpy as np
import pytest

from bench.matching import (
    Outcome,
    Tally,
    absolute_orientation,
    drift_found,
    limits,
    main,
    pose_methods,
    scale_found,
    simulate,
)
from spinewatch.markers import FLAT_10_14_18
from spinewatch.simulation.observations import FeatureNoise
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.scenes import SceneParameters
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.pose import Ball, MeasuredTriad, ball_centres

KINDS = (
    "complete",
    "one ball hidden",
    "320 mm, 24 deg",
    "300 mm, 18 deg",
    "480 mm, 32 deg",
    "gaps 1:3:2",
    "bent by 90 deg",
    "7 triads, 60 features",
    "5 triads, 200 features",
)
SMALL = {
    "none": 0.0,
    "calibration errors of 0.005 deg and 0.05 mm, 0.13 mrad shared": 0.5,
    "0.05 deg about its x": 100.0,
    "0.4 mm along its y": 90.0,
}
SCALE = (("0.3 deg about its y", 0.1, 97.0), ("a base longer by 1%", 0.1, 98.0))


def outcome(tally: Tally) -> Outcome:
    """The same counts for every kind of scene."""
    methods = pose_methods(3)
    tallies = [replace(tally, name=kind) for kind in KINDS]
    return Outcome(tallies, methods, tuple(SMALL.items()), SCALE, None)


def bars_missed(tally: Tally) -> set[str]:
    return {bar.promise for bar in outcome(tally).bars if not bar.holds}


@pytest.fixture(scope="module")
def one_hidden() -> Tally:
    parameters = SceneParameters(hidden=1, noise=FeatureNoise(0.1, 0.0, 10))
    return simulate("one ball hidden", large_rig(), parameters, 12)


def test_scenes_are_counted(one_hidden: Tally) -> None:
    assert (one_hidden.scenes, one_hidden.placed, one_hidden.hidden) == (12, 48, 12)
    assert one_hidden.complete_pct >= 90
    assert one_hidden.false == 0
    assert min(one_hidden.coverage(occluded=False)) >= 80
    assert len(one_hidden.milliseconds) == 12


def test_bars_are_missed_when_features_are_blurred(one_hidden: Tally) -> None:
    blurred = simulate("blurred", large_rig(), SceneParameters(noise=FeatureNoise(8.0, 0.0, 10)), 3)
    assert blurred.complete_pct == 0
    assert np.isnan(blurred.coverage(occluded=True)).all()
    missed = bars_missed(replace(blurred, hidden=12))
    assert "all triads, bent by 90 deg" in missed
    assert "all triads in >= 99.5% of 3 scenes" in missed
    assert "a pose in >= 98% with a ball hidden in a view" in missed
    assert "all triads, bent by 90 deg" not in bars_missed(replace(one_hidden, complete=12))


def test_false_triads_miss_their_bars(one_hidden: Tally) -> None:
    missed = bars_missed(replace(one_hidden, false=1))
    assert "false triads in < 0.1% of them" in missed
    assert "false triads in < 0.1% of them" not in bars_missed(one_hidden)


def test_poses_from_ball_images_are_better_than_absolute_orientation() -> None:
    peer, ours = pose_methods(12)
    assert len(peer.chi2) == len(ours.chi2) == 48
    assert ours.rotation_rms_deg < 0.9 * peer.rotation_rms_deg
    assert (ours.chi2 < 16.3).mean() > 0.97  # one in a thousand, 3 degrees of freedom
    assert (peer.chi2 < 16.3).mean() > 0.97


def test_absolute_orientation_of_exact_balls_is_the_true_pose() -> None:
    truth = random_spine(np.random.default_rng(0), 1)[0]
    balls = {
        name: Ball(centre, 0.01 * np.eye(3), np.zeros(2), np.zeros(2), 0.0)
        for name, centre in zip(FLAT_10_14_18.balls, ball_centres([truth])[0], strict=True)
    }
    pose = absolute_orientation(MeasuredTriad("flat", balls, None, 0.0), FLAT_10_14_18)
    assert np.allclose(pose.position_mm, truth.position_mm)
    assert np.allclose(pose.rotation, truth.rotation)
    assert pose.position_sd_mm.max() < 0.2


def test_bumps_across_the_epipolar_lines_are_flagged_and_rigs_without_drift_are_not() -> None:
    found = dict(drift_found(4))
    assert found["0.05 deg about its x"] == 100
    assert found["none"] == 0


def test_motions_along_the_epipolar_lines_are_flagged_by_the_scale_of_the_markers() -> None:
    found = {(name, sigma): share for name, sigma, share in scale_found(10)}
    assert found["0.3 deg about its y", 0.1] >= 80
    assert found["a base longer by 1%", 0.1] >= 80
    assert found["2 mm towards the field", 0.1] <= 10


def test_predicted_deviations_are_proportional_to_the_error_of_centres() -> None:
    rows = limits().rows
    assert float(rows[1][1]) == pytest.approx(float(rows[0][1]) / 2, abs=0.02)


def test_check_ends_with_1_when_a_bar_is_missed(
    monkeypatch: pytest.MonkeyPatch, one_hidden: Tally, capsys: pytest.CaptureFixture[str]
) -> None:
    for false, status in ((0, 0), (1, 1)):
        tally = replace(one_hidden, false=false, complete=12, hidden_posed=12, milliseconds=[1.0])
        made = outcome(tally)
        within = {k: [(0.0, 0.0)] * 95 + [(99.0, 99.0)] * 5 for k in (False, True)}
        made = replace(made, simulated=[replace(t, chi2=within) for t in made.simulated])
        monkeypatch.setattr("bench.matching.measure", lambda count, root, made=made: made)
        assert main(["--check"]) == status
        assert ("MISSED" in capsys.readouterr().out) == bool(status)
