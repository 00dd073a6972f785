"""Small results of the library for tests of the contract."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float
from spinewatch.detection.candidates.search import Detection
from spinewatch.detection.candidates.surgical_field import SurgicalField
from spinewatch.detection.features import Features
from spinewatch.flags import Flag
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.imaging.exposure import Exposure
from spinewatch.parameters import Parameters
from spinewatch.stage import StageMeasurement
from spinewatch.triads.labels import LabelledTriad
from spinewatch.triads.pose import Ball, MeasuredTriad, Pose


def pose(seed: int = 5) -> Pose:
    random = np.random.default_rng(seed)
    A: Float = random.normal(size=(6, 6))
    rotation = rotation_from_vector(random.normal(size=3))
    return Pose(random.normal(size=3) * 100, rotation, A @ A.T)


def ball() -> Ball:
    covariance = np.diag([0.04, 0.09, 0.25])
    return Ball(np.array([4.0, 5, 6]), covariance, np.array([7.5, 8]), np.array([9.0, 1]), 0.125)


def labelled(label: str | None = "L1", reason: str | None = None) -> LabelledTriad:
    balls = {name: ball() for name in ("XX", "YY", "MX")}
    return LabelledTriad(label, reason, MeasuredTriad("flat-10-14-18", balls, pose(), 0.5))


def measurement() -> StageMeasurement:
    covariance = np.array([[[0.16, 0.01], [0.01, 0.36]]])
    features = Features(np.array([[10.0, 20]]), np.array([0.75]), covariance, np.array([0.5]))
    left = Detection(features, SurgicalField(1, 2, 3, 4), Exposure.NORMAL, ())
    right = Detection(Features.empty(), SurgicalField(5, 6, 7, 8), Exposure.GLARE, ())
    triads = (labelled(), labelled(None, "no gap decides"))
    return StageMeasurement(
        left, right, triads, (Flag("triad-count-low", "1 of 2"),), None, Parameters(), "test"
    )
