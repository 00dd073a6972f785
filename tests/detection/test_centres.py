"""Highlights and centres: the law of reflection, and the sample surgery's exact centres."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from spinewatch.camera import Rig
from spinewatch.detection.centres import CentreParameters, Centres, View, refine_centres
from spinewatch.detection.detector import DetectionParameters, detect
from spinewatch.detection.highlight import (
    HighlightParameters,
    find_highlights,
    highlight_offsets,
    reflectors,
)
from spinewatch.features import Features
from spinewatch.formats.images import decode_image
from spinewatch.formats.rig_json import parse_rig
from spinewatch.pipeline import Parameters, nominal_ball_px, nominal_ranges_mm

SAMPLES = Path(__file__).parents[2] / "samples" / "D1"


@pytest.fixture(scope="module")
def rig() -> Rig:
    return parse_rig((SAMPLES / "rig.json").read_bytes())


@given(st.floats(150, 400), st.floats(120, 300), st.floats(-150, 150), st.floats(-150, 150))
def test_a_highlight_lies_where_the_sphere_mirrors_the_lamp_to_the_camera(
    u: float, v: float, dx: float, dy: float
) -> None:
    camera = parse_rig((SAMPLES / "rig.json").read_bytes()).left
    lamp = np.array([435.0 + dx, 440.0 + dy, 740.0])
    balls = reflectors(camera, np.array([[u, v]]), 690.0, 4.0)
    (offset,) = highlight_offsets(balls, lamp)
    # The exact mirror point, by iterating the law of reflection on the sphere's own surface.
    centre = balls.centre_mm[0]
    point = centre
    for _ in range(50):
        to_camera, to_lamp = camera.centre - point, lamp - point
        normal = to_camera / np.linalg.norm(to_camera) + to_lamp / np.linalg.norm(to_lamp)
        point = centre + 4.0 * normal / np.linalg.norm(normal)
    assert offset == pytest.approx(camera.project(point) - camera.project(centre), abs=0.02)


def test_a_highlight_is_its_centroid_and_a_dull_ball_has_none() -> None:
    y, x = np.mgrid[:40, :60]
    picture = np.where(np.hypot((x - 20) / 4.5, (y - 20) / 5.3) < 1, 20.0, 150.0)
    picture += 90 * np.exp(-((x - 21.3) ** 2 + (y - 19.6) ** 2) / (2 * 0.8**2))
    picture[15:26, 40:49] = 20.0
    found = find_highlights(
        picture, np.array([[20.0, 20.0], [44.0, 20.0]]), np.full(2, 130.0), (9.0, 10.6), HighlightParameters()
    )
    assert found.present.tolist() == [True, False]
    assert found.xy_px[0] == pytest.approx([21.3, 19.6], abs=0.1)


def errors_of_stage(
    name: str, rig: Rig
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return centre errors before and after refinement (n, 2), and the variances stated after it (n, 2)."""
    truth = json.loads((SAMPLES / name / "truth.json").read_text())
    parameters = Parameters()
    views, centres = [], []
    for side, camera, ball, range_mm in zip(
        ("left", "right"),
        (rig.left, rig.right),
        nominal_ball_px(rig, parameters),
        nominal_ranges_mm(rig, parameters),
        strict=True,
    ):
        image = decode_image((SAMPLES / name / f"{side}.png").read_bytes())
        found = detect(image, "left" if side == "left" else "right", ball, DetectionParameters())
        views.append(View(camera, image, found.features, ball, range_mm))
        centres.append([b[side]["center_px"] for t in truth["triads"] for b in t["balls"].values()])
    refined = refine_centres(views[0], views[1], 4.0, CentreParameters())
    before, after, stated = [], [], []
    for view, features, true in zip(views, (refined.left, refined.right), centres, strict=True):
        near = np.linalg.norm(view.features.xy_px[None] - np.array(true)[:, None], axis=2).argmin(axis=1)
        before.append(view.features.xy_px[near] - true)
        after.append(features.xy_px[near] - true)
        stated.append(features.covariance_px2[near].diagonal(axis1=1, axis2=2))
    return np.concatenate(before), np.concatenate(after), np.concatenate(stated)


def test_refined_centres_are_within_a_tenth_of_a_pixel_and_say_so(rig: Rig) -> None:
    parts = [errors_of_stage(name, rig) for name in ("PRE", "INTER", "POST")]
    before, after, stated = (np.concatenate(part) for part in zip(*parts, strict=True))
    assert np.sqrt((after**2).mean(axis=0)).max() < 0.1
    assert (after**2).mean() < (before**2).mean()
    assert np.abs(after.mean(axis=0)).max() < CentreParameters().common_sd_px
    assert 0.3 < (after**2 / stated).mean() < 1.5


def settle(image: NDArray[np.uint8], xy: NDArray[np.float64], rig: Rig) -> Centres:
    features = Features.with_sigma(xy, np.linspace(0.9, 0.5, len(xy)), 0.3)
    views = [View(camera, image, features, (9.1, 10.8), 700.0) for camera in (rig.left, rig.right)]
    return refine_centres(views[0], views[1], 4.0, CentreParameters())


def test_without_highlights_there_is_no_lamp_and_without_features_nothing(rig: Rig) -> None:
    plain = np.full((416, 568), 120, np.uint8)
    some = settle(plain, np.random.default_rng(1).uniform(100, 300, (12, 2)), rig)
    assert some.lamp_mm is None
    assert np.isfinite(some.left.xy_px).all()
    none = settle(plain, np.empty((0, 2)), rig)
    assert len(none.left) == len(none.right) == 0


@pytest.mark.parametrize("shape", [(1, 1), (1, 500), (5, 5), (60, 80)])
@pytest.mark.parametrize("ball", [(0.5, 0.6), (2.0, 2.4), (9.1, 10.8), (200.0, 240.0)])
def test_no_image_and_no_size_of_ball_stops_detection(
    shape: tuple[int, int], ball: tuple[float, float], rig: Rig
) -> None:
    image = np.random.default_rng(3).integers(0, 65535, shape).astype(np.uint16)
    found = detect(image, "left", ball, DetectionParameters())
    assert len(found.features) or found.flags
    view = View(rig.left, image, found.features, ball, 700.0)
    refined = refine_centres(view, view, 4.0, CentreParameters()).left
    assert np.isfinite(refined.xy_px).all()
    assert np.all(np.linalg.eigvalsh(refined.covariance_px2) > 0)
