"""Bursts: means, their deviations, breathing, and pairs that are missing or wrong."""

from __future__ import annotations

import numpy as np
import pytest

from spinewatch.arrays import Float
from spinewatch.errors import ParameterError
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.tracking.burst import BurstParameters, combine_burst
from spinewatch.triads.pose import Pose

LABELS = ("L1", "T11", "T9", "T7")
COVARIANCE = np.diag([0.05, 0.05, 0.12, 0.3, 0.3, 0.15]) ** 2
UP = np.array([0.0, 0.0, 1.0])
Pairs = list[dict[str, Pose]]


def true_position(j: int) -> Float:
    return np.array([50.0 * j, 0.0, 0.0])


def burst(
    n: int, step_s: float, seed: int, breathing_mm: float = 2.0, shared: float = 0.0, noise: float = 1.0
) -> tuple[Pairs, Float]:
    """Return pairs of four triads; T7 breathes by the whole amplitude along z, L1 by 0.4 of it, every 4 s."""
    random = np.random.default_rng(seed)
    root = noise * np.linalg.cholesky(COVARIANCE)
    times, phase = step_s * np.arange(n, dtype=np.float64), random.uniform(0, 2 * np.pi)
    common = [np.sqrt(shared) * root @ random.normal(size=6) for _ in LABELS]
    pairs: Pairs = [{} for _ in range(n)]
    for k, pair in enumerate(pairs):
        for j, label in enumerate(LABELS):
            error = common[j] + np.sqrt(1 - shared) * root @ random.normal(size=6)
            z = breathing_mm / 2 * (0.4 + 0.2 * j) * np.sin(2 * np.pi * times[k] / 4 + phase)
            position = true_position(j) + z * UP + error[:3]
            pair[label] = Pose(position, rotation_from_vector(np.radians(error[3:])), COVARIANCE)
    return pairs, times


def test_one_pair_is_its_own_mean() -> None:
    pairs, _ = burst(1, 1.0, 0)
    result = combine_burst(pairs)
    assert np.array_equal(result.poses["T9"].position_mm, pairs[0]["T9"].position_mm)
    assert np.array_equal(result.poses["T9"].rotation, pairs[0]["T9"].rotation)
    assert np.allclose(result.poses["T9"].covariance, COVARIANCE)
    assert (result.breathing, result.flags) == (None, ())


def test_the_mean_of_two_poses_by_hand() -> None:
    turned = rotation_from_vector(np.radians([0.0, 0.0, 0.2]))
    pairs = [
        {"L1": Pose(np.array([1.0, 2.0, 3.0]), np.eye(3), COVARIANCE)},
        {"L1": Pose(np.array([1.02, 2.0, 3.04]), turned, COVARIANCE)},
    ]
    pose = combine_burst(pairs).poses["L1"]
    assert np.allclose(pose.position_mm, [1.01, 2.0, 3.02])
    assert np.allclose(pose.rotation, rotation_from_vector(np.radians([0.0, 0.0, 0.1])))


def test_the_constant_of_breathing_is_the_mean_even_where_the_pairs_show_more_of_one_half() -> None:
    pairs, times = burst(11, 0.5, 4, noise=1e-4)  # five quarters of a cycle
    plain = np.mean([pair["T7"].position_mm[2] for pair in pairs])
    result = combine_burst(pairs, times, "L1")
    assert abs(plain) > 0.05
    assert result.poses["T7"].position_mm[2] == pytest.approx(0.0, abs=1e-3)


def test_breathing_is_reported_with_deviations_that_hold() -> None:
    z_period, z_amplitude, z_relative = [], [], []
    for seed in range(30):
        found = combine_burst(*burst(30, 0.4, seed), "L1").breathing
        assert found is not None
        z_period.append((found.period_s - 4.0) / found.period_sd_s)
        movement = found.movements["T7"]
        assert movement.relative_mm is not None
        assert movement.relative_sd_mm is not None
        z_amplitude.append((movement.amplitude_mm - 2.0) / movement.amplitude_sd_mm)
        z_relative.append((movement.relative_mm - 1.2) / movement.relative_sd_mm)
        assert found.movements["L1"].relative_mm is None
    for z in (z_period, z_amplitude, z_relative):
        assert np.sqrt(np.mean(np.square(z))) < 1.6


@pytest.mark.parametrize("n", [8, 16, 32])
def test_the_deviation_falls_with_the_root_of_the_number_and_no_pose_is_biased(n: int) -> None:
    z, sd = [], []
    for seed in range(40):
        result = combine_burst(*burst(n, 8.0 / n, seed), "L1")
        for j, label in enumerate(LABELS):
            pose = result.poses[label]
            z.append((pose.position_mm - true_position(j)) / pose.position_sd_mm)
            sd.append(pose.position_sd_mm)
    assert np.mean(sd, axis=0) == pytest.approx(np.array([0.05, 0.05, 0.12]) / np.sqrt(n), rel=0.2)
    assert (np.abs(np.mean(z, axis=0)) < 0.2).all()
    assert np.sqrt(np.mean(np.square(z), axis=0)) == pytest.approx(np.ones(3), abs=0.25)


def test_errors_that_all_pairs_share_are_not_averaged_away() -> None:
    z = []
    for seed in range(30):
        result = combine_burst(*burst(40, 0.3, seed, shared=0.5), "L1")
        assert 0.25 < result.shared_position_share < 0.7
        assert 0.25 < result.shared_rotation_share < 0.7
        for j, label in enumerate(LABELS):
            pose = result.poses[label]
            z.append((pose.position_mm - true_position(j)) / pose.position_sd_mm)
            assert pose.position_sd_mm[0] > 0.5 * 0.05
    assert np.sqrt(np.mean(np.square(z))) == pytest.approx(1.0, abs=0.25)


def test_spread_beyond_the_noise_enlarges_the_deviation() -> None:
    random = np.random.default_rng(8)
    pairs = [
        {
            label: Pose(true_position(j) + random.normal(size=3) * 0.5, np.eye(3), COVARIANCE)
            for j, label in enumerate(LABELS)
        }
        for _ in range(20)
    ]
    sd = combine_burst(pairs).poses["T9"].position_sd_mm
    assert (sd > 0.5 / np.sqrt(20) * 0.6).all()
    assert (sd < 0.5).all()


def test_what_all_triads_do_together_is_no_spread() -> None:
    pairs, _ = burst(20, 0.4, 1, breathing_mm=0.0)
    moved = [
        {
            label: Pose(pose.position_mm + k % 2 * UP, pose.rotation, pose.covariance)
            for label, pose in p.items()
        }
        for k, p in enumerate(pairs)
    ]
    still, moving = combine_burst(pairs).poses["T9"], combine_burst(moved).poses["T9"]
    assert np.allclose(moving.position_mm, still.position_mm + 0.5 * UP)
    assert np.allclose(moving.covariance, still.covariance, rtol=0.05)


def test_a_triad_that_is_missing_in_some_pairs_is_not_displaced_by_the_common_movement() -> None:
    pairs, _ = burst(10, 0.4, 1, breathing_mm=0.0, noise=1e-3)
    moved: Pairs = []
    for k, p in enumerate(pairs):
        rise = [0.0, 0.0, 2.0 if k < 5 else 0.0]
        moved.append({a: Pose(b.position_mm + rise, b.rotation, b.covariance) for a, b in p.items()})
        if k < 5:
            del moved[-1]["T9"]
    result = combine_burst(moved)
    assert result.pairs_used == {"L1": 10, "T11": 10, "T7": 10, "T9": 5}
    # all others are shown at 1 on average, so T9 is too, though it was seen at 0 only
    assert result.poses["T9"].position_mm[2] == pytest.approx(1.0, abs=0.01)
    assert [flag.code for flag in result.flags] == ["burst-incomplete", "breathing-unresolved"]
    assert "T9 in 5" in result.flags[0].detail


def test_a_triad_in_too_few_pairs_for_breathing_takes_the_movement_of_the_others() -> None:
    pairs, times = burst(24, 0.37, 2, noise=1e-3)
    for k, pair in enumerate(pairs):
        if k > 1:
            del pair["T9"]
    result = combine_burst(pairs, times, "L1")
    assert result.breathing is not None
    assert "T9" not in result.breathing.movements
    seen = np.mean([pairs[k]["T9"].position_mm[2] for k in (0, 1)])
    assert abs(result.poses["T9"].position_mm[2]) < abs(seen)


def test_an_outlier_is_left_out_and_named() -> None:
    pairs, times = burst(16, 0.5, 3)
    clean = combine_burst([{**p} for p in pairs], times, "L1")
    pose = pairs[6]["T9"]
    pairs[6]["T9"] = Pose(pose.position_mm + 5 * UP, pose.rotation, pose.covariance)
    result = combine_burst(pairs, times, "L1")
    assert result.outliers[6] == ("T9",)
    assert sum(map(len, result.outliers)) == 1
    assert result.pairs_used["T9"] == 15
    assert np.abs(result.poses["T9"].position_mm - clean.poses["T9"].position_mm).max() < 0.05
    (flag,) = result.flags
    assert flag.code == "burst-outlier"
    assert "T9 in pair 7" in flag.detail


def test_sound_bursts_have_no_outliers() -> None:
    assert not any(any(combine_burst(*burst(12, 0.5, seed), "L1").outliers) for seed in range(60))


def test_a_burst_within_a_part_of_a_breath_is_flagged_with_the_expected_error() -> None:
    result = combine_burst(*burst(4, 0.1, 5), "L1")
    assert result.breathing is None
    (flag,) = result.flags
    assert flag.code == "breathing-unresolved"
    assert "0.7" in flag.detail  # 1 mm / sqrt 2, hardly averaged


def test_in_apnoea_no_breathing_is_found() -> None:
    found = [combine_burst(*burst(20, 0.4, seed, breathing_mm=0.0), "L1").breathing for seed in range(30)]
    assert found == [None] * 30


def test_a_label_that_no_pair_shows_has_no_pose() -> None:
    assert combine_burst([{}, {}], np.array([0.0, 1.0])).poses == {}


@pytest.mark.parametrize("times", [[0.0], [0.0, np.nan], [[0.0, 1.0]]])
def test_times_that_do_not_fit_the_pairs_are_refused(times: list[float]) -> None:
    pairs, _ = burst(2, 1.0, 0)
    with pytest.raises(ParameterError, match="one finite time"):
        combine_burst(pairs, np.array(times))


def test_an_empty_burst_is_refused() -> None:
    with pytest.raises(ParameterError, match="at least one pair"):
        combine_burst([])


def test_periods_must_be_in_order() -> None:
    with pytest.raises(ParameterError, match="ascending"):
        BurstParameters(period_range_s=(4.0, 2.0))


def test_poses_that_are_stated_to_be_exact_are_averaged_too() -> None:
    exact = [{"L1": Pose(x * UP, np.eye(3), np.zeros((6, 6)))} for x in (1.0, 1.0, 1.0)]
    pose = combine_burst(exact, np.array([0.0, 1.0, 2.0]), "L1").poses["L1"]
    assert np.allclose(pose.position_mm, UP)
    assert np.allclose(pose.covariance, 0)
