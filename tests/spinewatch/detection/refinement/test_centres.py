"""Centres: the sample surgery's exact ones, the outline of a sphere in perspective, and pictures that show nothing."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from spinewatch.arrays import Pixels
from spinewatch.camera import Camera, Rig
from spinewatch.detection.candidates.search import DetectionParameters, detect
from spinewatch.detection.features import Features
from spinewatch.detection.refinement.centres import (
    CandidateView,
    CentreParameters,
    outline_offsets,
    rank_features,
    settle_centres,
)
from spinewatch.imaging.decoding import decode_image
from spinewatch.pipeline import SIDES, Parameters, find_balls
from spinewatch.rig_files.rig_json import parse_rig
from spinewatch.simulation.rigs import table_3_3_rig
from tests.paths import SAMPLES

D1 = SAMPLES / "D1"
LAMP = np.array([0.25, 0.0])


@pytest.fixture(scope="module")
def rig() -> Rig:
    return parse_rig((D1 / "rig.json").read_bytes())


def pair(name: str) -> tuple[Pixels, Pixels]:
    left, right = (decode_image((D1 / name / f"{side}.png").read_bytes()) for side in SIDES)
    return left, right


def errors_of_stage(name: str, rig: Rig) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the errors of refined centres and the deviations stated, each (n, 2), px."""
    truth = json.loads((D1 / name / "truth.json").read_text())
    errors, stated = [], []
    for side, found in zip(SIDES, find_balls(pair(name), rig, Parameters()), strict=True):
        true = np.array([b[side]["center_px"] for t in truth["triads"] for b in t["balls"].values()])
        settled = found.features
        near = np.linalg.norm(settled.xy_px[None] - true[:, None], axis=2).argmin(axis=1)
        errors.append(settled.xy_px[near] - true)
        stated.append(np.sqrt(settled.covariance_px2[near].diagonal(axis1=1, axis2=2)))
    return np.concatenate(errors), np.concatenate(stated)


def test_refined_centres_are_within_a_tenth_of_a_pixel_and_say_so(rig: Rig) -> None:
    parts = [errors_of_stage(name, rig) for name in ("PRE", "INTER", "POST")]
    after, stated = (np.concatenate(part) for part in zip(*parts, strict=True))
    assert np.sqrt((after**2).mean(axis=0)).max() < 0.1
    assert 0.3 < ((after / stated) ** 2).mean() < 1.5


def test_balls_come_first_and_no_ball_twice(rig: Rig) -> None:
    features = find_balls(pair("PRE"), rig, Parameters())[0].features
    assert np.all(features.score[:12] > 0.75)
    assert features.visible is not None
    assert np.all(features.visible[:12] > 0.6)
    apart = np.linalg.norm(features.xy_px[:30, None] - features.xy_px[:30], axis=2) + 99 * np.eye(30)
    assert apart.min() > 1.5


def turned(camera: Camera, u: float, v: float, range_mm: float) -> NDArray[np.float64]:
    return np.asarray(camera.centre + range_mm * camera.directions(np.array([[u, v]]))[0])


@given(st.floats(0, 567), st.floats(0, 415), st.floats(300, 900))
def test_the_centre_of_an_outline_is_corrected_to_that_of_the_ball(
    u: float, v: float, range_mm: float
) -> None:
    camera = table_3_3_rig().left
    centre = turned(camera, u, v, range_mm)
    # The rim that the camera sees, traced: where rays touch a ball of 40 mm, enlarged so that the effect shows.
    radius = 20.0
    toward = camera.centre - centre
    distance = np.linalg.norm(toward)
    toward = toward / distance
    side = np.linalg.svd(toward[None])[2][1:]
    turn = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    sine = radius / distance
    rim = centre + radius * (
        sine * toward
        + np.sqrt(1 - sine**2) * (np.cos(turn)[:, None] * side[0] + np.sin(turn)[:, None] * side[1])
    )
    plain = replace(camera, radial=(0.0, 0.0), decentering=(0.0, 0.0))
    outline = plain.project(rim)
    a, b = outline, np.roll(outline, -1, axis=0)
    cross = a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1]
    area_centre = ((a + b) * cross[:, None]).sum(axis=0) / (3 * cross.sum())
    true = plain.project(centre)
    width = 2 * radius * plain.focal_length_mm / np.sqrt(distance**2 - radius**2) / plain.pixel_size_mm[0]
    offset = outline_offsets(plain, area_centre[None], width)[0]
    assert offset == pytest.approx(area_centre - true, abs=0.02)


def settle(view: CandidateView) -> Features:
    """Settle a view's centres beside another one that shows nothing."""
    nothing = replace(view, image=np.full((9, 9), 7, np.uint8), features=Features.empty())
    p = CentreParameters()
    settled, none = settle_centres((rank_features(view, p), rank_features(nothing, p)), p)
    assert len(none) == 0
    return settled


def settle_at(image: NDArray[np.uint8], xy: NDArray[np.float64], rig: Rig) -> Features:
    features = Features.with_sigma(xy, np.linspace(0.9, 0.5, len(xy)), 0.3)
    return settle(CandidateView(rig.left, image, features, (9.1, 10.8), LAMP))


def test_an_even_picture_has_no_balls_and_no_features_stay_none(rig: Rig) -> None:
    plain = np.full((416, 568), 120, np.uint8)
    some = settle_at(plain, np.random.default_rng(1).uniform(100, 300, (12, 2)), rig)
    assert np.isfinite(some.xy_px).all()
    assert some.score.max() < 0.6  # templates alone would say 0.9
    assert len(settle_at(plain, np.empty((0, 2)), rig)) == 0


@pytest.mark.parametrize("shape", [(1, 1), (1, 500), (5, 5), (60, 80)])
@pytest.mark.parametrize("ball", [(0.5, 0.6), (2.0, 2.4), (9.1, 10.8), (200.0, 240.0)])
def test_no_image_and_no_size_of_ball_stops_detection(
    shape: tuple[int, int], ball: tuple[float, float], rig: Rig
) -> None:
    image = np.random.default_rng(3).integers(0, 65535, shape).astype(np.uint16)
    found = detect(image, "left", ball, DetectionParameters())
    assert len(found.features) or found.flags
    refined = settle(CandidateView(rig.left, image, found.features, ball, LAMP))
    assert np.isfinite(refined.xy_px).all()
    assert np.all(np.linalg.eigvalsh(refined.covariance_px2) > 0)
