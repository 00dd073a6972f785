from dataclasses import replace

import numpy as np
import pytest

from spinewatch.camera import Rig
from spinewatch.markers import FLAT_10_14_18
from spinewatch.simulation.observations import FeatureNoise, observe
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.camera_motion import likeliest_rotations
from spinewatch.triads.diagnosis_parameters import DiagnosisParameters
from spinewatch.triads.search import SearchParameters

RIG, PARAMETERS = large_rig(), DiagnosisParameters()


def rotations(
    pitch_deg: float, roll_deg: float, parameters: DiagnosisParameters = PARAMETERS
) -> list[tuple[float, float]]:
    """Rotations that are found when the right camera was rotated, degrees."""
    turned = RIG.right.moved(np.radians([pitch_deg, 0, roll_deg]), np.zeros(3))
    rng = np.random.default_rng(1)
    spine = random_spine(rng, 4, spacing_mm=45)
    seen = observe(Rig("turned", RIG.left, turned), spine, rng, FeatureNoise(0.1, false_features=15))
    pair = seen.left, seen.right
    found = likeliest_rotations(pair, RIG, SearchParameters(), [FLAT_10_14_18], parameters)
    return [(float(np.degrees(pitch)), float(np.degrees(roll))) for pitch, roll in found]


@pytest.mark.parametrize(("pitch_deg", "roll_deg"), [(0.5, 0.0), (-0.8, 0.0), (0.5, 0.8)])
def test_the_rotation_of_the_right_camera_is_found(pitch_deg: float, roll_deg: float) -> None:
    found = rotations(pitch_deg, roll_deg)
    assert 0 < len(found) <= PARAMETERS.max_offsets
    gaps = [abs(pitch - pitch_deg) + 0.3 * abs(roll - roll_deg) for pitch, roll in found]
    assert min(gaps) < 0.1


def test_rotations_are_within_the_limits_and_apart() -> None:
    found = np.radians(rotations(0.5, 0.0, replace(PARAMETERS, max_offsets=6))) * 1000
    assert len(found) > 1
    assert np.all(np.hypot(*found.T) >= PARAMETERS.min_offset_mrad)
    weights = np.array([1.0, PARAMETERS.roll_separation_weight])
    apart = np.abs(found[:, None] - found) @ weights
    assert np.all(apart[np.triu_indices(len(found), 1)] > PARAMETERS.offset_separation_mrad)


def test_without_a_range_no_rotation_is_known() -> None:
    parallel = Rig("parallel", RIG.left, replace(RIG.right, rotation_deg=RIG.left.rotation_deg))
    seen = observe(
        RIG, random_spine(np.random.default_rng(1), 4), np.random.default_rng(1), FeatureNoise(0.1)
    )
    pair = seen.left, seen.right
    assert likeliest_rotations(pair, parallel, SearchParameters(), [FLAT_10_14_18], PARAMETERS) == []
