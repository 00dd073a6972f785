"""An image is a negative when balls are found in its negative only."""

from dataclasses import replace

import numpy as np
import pytest

from spinewatch.detection.candidates.search import DetectionParameters
from spinewatch.detection.detector import BallDetector, prepare_detector
from spinewatch.detection.features import Features
from spinewatch.detection.negative import is_negative
from spinewatch.detection.refinement.centre_parameters import CentreParameters
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.exposure import Exposure
from spinewatch.imaging.frame import Frame
from spinewatch.rig_files.rig_json import parse_rig
from tests.paths import SAMPLES

D1 = SAMPLES / "D1"


@pytest.fixture(scope="module")
def detector() -> BallDetector:
    rig = parse_rig((D1 / "rig.json").read_bytes())
    return prepare_detector(rig, (711.0, 695.8), 8.0, DetectionParameters(), CentreParameters())


def judged(
    detector: BallDetector, frame: Frame, features: Features, exposure: Exposure | None = None
) -> bool:
    found = replace(detector.searches[0].detect(frame), features=features)
    if exposure is not None:
        found = replace(found, exposure=exposure)
    view, search = detector.views[0], detector.searches[0]
    return is_negative(frame, found, view, search, detector.networks, detector.centres)


def test_balls_in_the_negative_only_tell_it(detector: BallDetector) -> None:
    image = decode_image((D1 / "PRE" / "left.png").read_bytes())
    upright, reversed_ = Frame(image, "left"), Frame(255 - image, "left")
    none = Features.empty()
    assert judged(detector, reversed_, none)
    assert not judged(detector, upright, none)
    assert not judged(detector, reversed_, none, Exposure.BLANK)
    balls = Features.with_sigma(np.full((6, 2), 100.0), np.full(6, 0.9), 0.1)
    assert not judged(detector, reversed_, balls)
