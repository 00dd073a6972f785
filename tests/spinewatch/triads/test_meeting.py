from dataclasses import replace

import numpy as np

from spinewatch.camera import Rig
from spinewatch.detection.features import Features
from spinewatch.matching.epipolar import EpipolarParameters
from spinewatch.simulation.observations import FeatureNoise, Observation, observe
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.diagnosis_parameters import DiagnosisParameters
from spinewatch.triads.meeting import meeting_sigma

RIG, PARAMETERS = large_rig(), DiagnosisParameters()
x, y, z = (RIG.left.centre + np.array([60.0, 0, 0]) @ RIG.left.M).tolist()
PARALLEL = Rig("parallel", RIG.left, replace(RIG.left, position_mm=(x, y, z)))


def observed(rig: Rig, seed: int) -> Observation:
    rng = np.random.default_rng(seed)
    return observe(rig, random_spine(rng, 4, spacing_mm=45), rng, FeatureNoise(0.1, false_features=15))


def sigma(left: Features, right: Features, rig: Rig, epipolar: EpipolarParameters) -> float:
    return meeting_sigma((left, right), rig, epipolar, PARAMETERS)


def test_more_features_meet_when_images_belong_together() -> None:
    one, two = observed(RIG, 1), observed(RIG, 2)
    together, apart = (sigma(one.left, f, RIG, EpipolarParameters()) for f in (one.right, two.right))
    assert together > PARAMETERS.related_sigma > apart


def test_parallel_cameras_need_a_range() -> None:
    one, two = observed(PARALLEL, 1), observed(PARALLEL, 2)
    assert sigma(one.left, one.right, PARALLEL, EpipolarParameters()) == 0
    given = EpipolarParameters(range_mm=(500, 900))
    together, apart = (sigma(one.left, f, PARALLEL, given) for f in (one.right, two.right))
    assert together > PARAMETERS.related_sigma > apart


def test_the_range_without_mm_is_that_of_the_diagnosis() -> None:
    one = observed(RIG, 1)
    usual, other = (
        sigma(one.left, one.right, RIG, EpipolarParameters(range_fractions=fractions))
        for fractions in ((0.65, 1.2), (0.1, 0.2))
    )
    assert usual == other
