"""The detector on the sample surgery, whose ball centres are known."""

import json
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from spinewatch.arrays import Pixels
from spinewatch.camera import Rig
from spinewatch.detection.candidates.search import DetectionParameters
from spinewatch.detection.candidates.templates import TemplateSet, default_template_set
from spinewatch.detection.detector import BallDetector, check_image_size, nominal_ball_px, prepare_detector
from spinewatch.detection.refinement.centre_parameters import CentreParameters
from spinewatch.errors import ImageSizeError, ParameterError
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import SIDES, Frame
from spinewatch.imaging.sharpness import SharpnessParameters
from spinewatch.rig_files.rig_json import parse_rig
from tests.paths import SAMPLES

D1 = SAMPLES / "D1"
RANGES_MM = (711.0, 695.8)
STAGES = ("PRE", "INTER", "POST")


@pytest.fixture(scope="module")
def rig() -> Rig:
    return parse_rig((D1 / "rig.json").read_bytes())


@pytest.fixture(scope="module")
def detector(rig: Rig) -> BallDetector:
    return prepare_detector(rig, RANGES_MM, 8.0, DetectionParameters(), CentreParameters())


def pair(name: str) -> tuple[Frame, Frame]:
    left, right = (Frame(decode_image((D1 / name / f"{side}.png").read_bytes()), side) for side in SIDES)
    return left, right


def true_centres(name: str, side: str) -> NDArray[np.float64]:
    """Return the centres (n, 2), px, of the balls of a stage in one view."""
    truth = json.loads((D1 / name / "truth.json").read_text())
    return np.array([b[side]["center_px"] for t in truth["triads"] for b in t["balls"].values()])


def errors_of_stage(name: str, detector: BallDetector) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the errors of refined centres and the deviations stated, each (n, 2), px."""
    errors, stated = [], []
    for side, found in zip(SIDES, detector.detect(*pair(name)), strict=True):
        true = true_centres(name, side)
        features = found.features
        near = np.linalg.norm(features.xy_px[None] - true[:, None], axis=2).argmin(axis=1)
        errors.append(features.xy_px[near] - true)
        stated.append(np.sqrt(features.covariance_px2[near].diagonal(axis1=1, axis2=2)))
    return np.concatenate(errors), np.concatenate(stated)


def test_centres_are_within_a_tenth_of_a_pixel_and_so_are_their_deviations(detector: BallDetector) -> None:
    parts = [errors_of_stage(name, detector) for name in STAGES]
    error, stated = (np.concatenate(part) for part in zip(*parts, strict=True))
    assert np.sqrt((error**2).mean(axis=0)).max() < 0.1
    assert 0.3 < ((error / stated) ** 2).mean() < 1.5


def test_balls_come_first_and_no_ball_twice(detector: BallDetector) -> None:
    true = true_centres("PRE", "left")
    features = detector.detect(*pair("PRE"))[0].features
    first = features.xy_px[: len(true)]
    assert np.linalg.norm(first[:, None] - true, axis=2).min(axis=1).max() < 1
    assert features.visible is not None
    assert np.all(features.visible[:12] > 0.6)
    apart = np.linalg.norm(features.xy_px[:30, None] - features.xy_px[:30], axis=2) + 99 * np.eye(30)
    assert apart.min() > 1.5


def test_a_pool_changes_no_bit(detector: BallDetector) -> None:
    alone = detector.detect(*pair("POST"))
    with ThreadPoolExecutor(1) as pool:
        together = detector.detect(*pair("POST"), pool)
    for one, other in zip(alone, together, strict=True):
        assert np.array_equal(one.features.xy_px, other.features.xy_px)
        assert np.array_equal(one.features.covariance_px2, other.features.covariance_px2)


def test_the_version_of_the_templates_is_known(rig: Rig, detector: BallDetector) -> None:
    ships = default_template_set()
    assert detector.template_version == ships.version
    mine = TemplateSet("mine", ships.diameter_px, ships.trees)
    parameters = (DetectionParameters(), CentreParameters())
    assert prepare_detector(rig, RANGES_MM, 8.0, *parameters, mine).template_version == "mine"


def test_frames_of_another_size_or_side_are_refused(rig: Rig, detector: BallDetector) -> None:
    left, right = pair("PRE")
    small = Frame(left.pixels[:-1], "left")
    with pytest.raises(ImageSizeError, match="568 x 415 pixels"):
        detector.detect(small, right)
    with pytest.raises(ImageSizeError):
        check_image_size(small, rig.left)
    with pytest.raises(ParameterError, match="left frame first"):
        detector.detect(right, left)


def test_balls_appear_larger_when_nearer(rig: Rig) -> None:
    (far, _), (near, _) = (nominal_ball_px(rig, (r, r), 8.0) for r in (700.0, 350.0))
    assert near == pytest.approx((2 * far[0], 2 * far[1]))


DEGRADED: dict[str, tuple[Callable[[Pixels], Any], str]] = {
    "defocus": (lambda image: cv2.GaussianBlur(image, (0, 0), 1.5), "image-blurred"),
    "motion": (lambda image: cv2.blur(image, (6, 1)), "image-blurred"),
    "half of the exposure": (lambda image: image // 2, "exposure-unequal"),
    "negative": (lambda image: 255 - image, "image-negative"),
}


@pytest.mark.parametrize(("change", "code"), DEGRADED.values(), ids=DEGRADED.keys())
def test_a_degraded_view_is_flagged(
    detector: BallDetector, change: Callable[[Pixels], Any], code: str
) -> None:
    left, right = pair("PRE")
    sound, degraded = detector.detect(left, Frame(np.asarray(change(right.pixels)), "right"))
    assert code in {flag.code for flag in degraded.flags}
    assert sound.flags == ()


@pytest.mark.parametrize("name", STAGES)
def test_sound_images_have_no_flag(name: str, detector: BallDetector) -> None:
    assert [found.flags for found in detector.detect(*pair(name))] == [(), ()]


def test_blur_enlarges_the_deviations_along_its_direction(detector: BallDetector) -> None:
    left, right = (Frame(np.asarray(cv2.blur(f.pixels, (5, 1)), np.uint8), f.side) for f in pair("PRE"))
    tolerant = replace(detector.searches[0].parameters, sharpness=SharpnessParameters(max_width_px=99))
    first, second = (replace(search, parameters=tolerant) for search in detector.searches)
    plain = replace(detector, searches=(first, second))
    for enlarged, usual in zip(detector.detect(left, right), plain.detect(left, right), strict=True):
        assert "image-blurred" not in {flag.code for flag in usual.flags}
        ratio = (enlarged.features.covariance_px2 / usual.features.covariance_px2)[:, [0, 1], [0, 1]]
        assert ratio[:, 0].min() > 1.2
        assert ratio[:, 1] == pytest.approx(1, abs=1e-9)


def test_a_hot_pixel_is_named(detector: BallDetector) -> None:
    left, right = pair("PRE")
    twelve = right.pixels.astype(np.uint16) * 16
    twelve[40, 60] = 65535
    flags = detector.detect(left, Frame(twelve, "right"))[1].flags
    assert [flag.code for flag in flags] == ["pixel-defect"]
    assert "u = 60, v = 40" in flags[0].detail


def test_a_second_look_finds_balls_near_their_places_and_leaves_the_others(detector: BallDetector) -> None:
    frames, truth = pair("PRE"), json.loads((D1 / "PRE" / "truth.json").read_text())
    found, reduced, places = detector.detect(*frames), [], []
    for side, detection in zip(SIDES, found, strict=True):
        ball = np.array(truth["triads"][0]["balls"]["YY"][side]["center_px"])
        far = np.linalg.norm(detection.features.xy_px - ball, axis=1) > 4
        reduced.append(replace(detection, features=detection.features.take(np.flatnonzero(far))))
        places.append(ball + np.array([[2.0, -1.0], [40.0, 60.0]]))
    again = detector.look_again(frames, (reduced[0], reduced[1]), (places[0], places[1]))
    for side, before, after in zip(SIDES, reduced, again, strict=True):
        ball = np.array(truth["triads"][0]["balls"]["YY"][side]["center_px"])
        assert np.linalg.norm(after.features.xy_px - ball, axis=1).min() < 1
        assert len(after.features) <= CentreParameters().n_kept
        assert np.all(np.diff(after.features.score) <= 0)
        best = before.features.xy_px[: CentreParameters().n_refined]
        assert all(np.any(np.all(xy == after.features.xy_px, axis=1)) for xy in best)
