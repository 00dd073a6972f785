import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.calibration.quality.size_accuracy import simulated_size_accuracy, size_accuracy
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.simulation.rigs import perturbed_rig
from tests.spinewatch.calibration.simulated import FIELD, TABLE_3_3

CENTRE = np.array([420.0, 380.0, 50.0])
seeds = st.integers(0, 2**32 - 1)


@given(seeds)
def test_rigid_motions_have_no_errors(seed: int) -> None:
    rng = np.random.default_rng(seed)
    X = FIELD.points_mm[:8]
    moved = X @ rotation_from_vector(rng.normal(0, 1, 3)).T + rng.normal(0, 50, 3)
    classes = size_accuracy([moved - X], [X], (50.0, 400.0, 900.0))
    assert len(classes) == 2
    for entry in classes:
        assert entry.distance_rms_mm < 1e-9
        assert entry.angle_rms_deg < 1e-6


def test_distances_and_angles_are_sorted_into_classes_by_size() -> None:
    X = np.array([[0.0, 0, 0], [100, 0, 0], [0, 300, 0]])
    residuals = np.array([[0.0, 0, 0], [1, 0, 0], [0, 0, 0]])
    small, large = size_accuracy([residuals], [X], (50.0, 150.0, 350.0))
    assert (small.size_mm, small.n_angles) == (100.0, 2)
    assert small.distance_rms_mm == pytest.approx(1.0)
    # Only the hypotenuse of 316 mm changes among the long distances; the angle between the long legs with it.
    assert large.distance_rms_mm == pytest.approx(
        np.sqrt(((np.hypot(101, 300) - np.hypot(100, 300)) ** 2) / 2)
    )
    assert large.n_angles == 1
    assert size_accuracy([residuals], [X], (400.0, 500.0)) == []


def test_simulated_angles_are_less_accurate_the_shorter_their_legs() -> None:
    found = simulated_size_accuracy(
        TABLE_3_3, [TABLE_3_3], CENTRE, (10.0, 100.0), 0.05, np.random.default_rng(0)
    )
    assert [e.size_mm for e in found] == [10.0, 100.0]
    assert found[0].angle_rms_deg == pytest.approx(10 * found[1].angle_rms_deg, rel=0.3)
    exact = simulated_size_accuracy(
        TABLE_3_3, [TABLE_3_3], CENTRE, (50.0,), 0.0, np.random.default_rng(0), 20
    )
    assert exact[0].distance_rms_mm < 1e-6


def test_wrong_rigs_add_to_the_noise() -> None:
    rng = np.random.default_rng(3)
    wrong = [perturbed_rig(TABLE_3_3, rng, 0.05, 0.5) for _ in range(5)]
    true, assumed = (
        simulated_size_accuracy(TABLE_3_3, rigs, CENTRE, (150.0,), 0.02, np.random.default_rng(0))[0]
        for rigs in ([TABLE_3_3], wrong)
    )
    assert assumed.distance_rms_mm > 1.5 * true.distance_rms_mm
