"""The variance factor of a stage."""

from __future__ import annotations

import numpy as np
import pytest

from spinewatch.detection.features import Features
from spinewatch.simulation.observations import FeatureNoise, observe
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.pose import MeasuredTriad, Pose
from spinewatch.triads.search import SearchParameters, match_triads
from spinewatch.triads.variance_factor import VarianceFactorParameters, variance_factor, variance_flags

RIG, P = large_rig(), VarianceFactorParameters()
POSE = Pose(np.zeros(3), np.eye(3), np.eye(6))


def triads(stated: float, count: int = 8) -> tuple[MeasuredTriad, ...]:
    """Return the triads of a spine whose centres have errors of 0.1 px per axis, with a stated deviation, px."""
    rng = np.random.default_rng(3)
    seen = observe(RIG, random_spine(rng, count), rng, FeatureNoise(0.1))
    left, right = (Features.with_sigma(part.xy_px, part.score, stated) for part in (seen.left, seen.right))
    search = match_triads(left, right, RIG, SearchParameters(), expected=count, axis="x")
    assert len(search.triads) == count
    return search.triads


def test_deviations_that_are_large_enough_stay() -> None:
    assert variance_factor(triads(0.14), P) == 1


@pytest.mark.parametrize("stated", [0.05, 0.065])
def test_the_factor_tells_how_much_too_small_deviations_are(stated: float) -> None:
    expected = (0.1 / stated) ** 2 / P.expected
    # 48 degrees of freedom: 20% of statistical error; the error that triads share and the prior make it smaller
    assert 0.5 * expected < variance_factor(triads(stated), P) < 1.2 * expected


def test_one_poor_triad_counts_less_than_a_poor_stage() -> None:
    good, poor = (MeasuredTriad("10-14-18", {}, POSE, 0.1, chi2=chi2, dof=6) for chi2 in (3.6, 18.0))
    assert 1 < variance_factor([poor], P) < variance_factor([poor] * 5, P)
    assert variance_factor([poor, *[good] * 4], P) < P.max_usual


def test_triads_without_a_pose_do_not_count() -> None:
    withheld = MeasuredTriad("10-14-18", {}, None, 0.1, "it is doubtful", chi2=60.0, dof=6, doubtful=True)
    assert variance_factor([withheld], P) == 1
    assert variance_factor([], P) == 1


def test_an_unusual_factor_is_flagged_with_the_growth_of_the_deviations() -> None:
    assert variance_flags(P.max_usual, P) == ()
    (flag,) = variance_flags(4.0, P)
    assert flag.code == "appearance-unusual"
    assert "2.0 times" in flag.detail
