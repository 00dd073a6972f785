"""A pair of feature lists with two triads and false features, as MATCH-POINT matches it."""

import numpy as np

from spinewatch.detection.features import Features
from spinewatch.markers import FLAT_10_14_18
from spinewatch.simulation.rigs import large_rig
from spinewatch.thesis_1995.match_point import MatchPoint, MatchPointParameters, match_point

RIG = large_rig()
ORIGINS_MM = np.array([[400.0, 390.0, 90.0], [460.0, 385.0, 92.0]])
BALLS_MM = np.concatenate([FLAT_10_14_18.coordinates_mm + origin for origin in ORIGINS_MM])
SHADOW_MM = BALLS_MM[:1] + np.array([1.5, 0.5, 0.0])
"""A false ball beside XX of the first triad, which makes a second triplet."""


def features() -> tuple[Features, Features]:
    points = np.concatenate([BALLS_MM, SHADOW_MM])
    left, right = (
        Features.with_sigma(camera.project(points), np.ones(len(points)), 0.3)
        for camera in (RIG.left, RIG.right)
    )
    return left, right


def matched() -> MatchPoint:
    return match_point(*features(), RIG, ["T10", "T9"], MatchPointParameters())
