import pytest

from bench.matching import Outcome, drift_found, limits, simulate
from spinewatch.simulation.observations import Noise
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.scenes import SceneParameters


def test_scenes_are_counted() -> None:
    parameters = SceneParameters(hidden=1, noise=Noise(0.1, 0.0, 10))
    tally = simulate("one ball hidden", large_rig(), parameters, 12)
    assert (tally.scenes, tally.placed, tally.hidden) == (12, 48, 12)
    assert tally.complete_pct >= 90
    assert tally.false == 0
    assert min(tally.coverage(occluded=False)) >= 80
    assert len(tally.milliseconds) == 12


def test_what_cannot_be_measured_is_missed() -> None:
    blurred = simulate("blurred", large_rig(), SceneParameters(noise=Noise(8.0, 0.0, 10)), 3)
    assert blurred.complete_pct == 0
    outcome = Outcome([], (), None)
    assert outcome.rendered is None


def test_bumps_across_the_epipolar_lines_are_found_and_others_not() -> None:
    found = dict(drift_found(4))
    assert found["0.05 deg about its x"] == 100
    assert found["none"] == 0


def test_limits_are_predicted() -> None:
    rows = limits().rows
    assert float(rows[1][1]) == pytest.approx(float(rows[0][1]) / 2, abs=0.02)
