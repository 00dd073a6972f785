"""Detection on the sample surgery, whose ball centres are known, and on images that show no surgery at all."""

import json
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from spinewatch.detection.candidates.property_spaces import PropertySpace
from spinewatch.detection.candidates.search import DetectionParameters, detect, prepare_search
from spinewatch.detection.candidates.templates import TemplateSet, default_template_set
from spinewatch.detection.detector import nominal_ball_px
from spinewatch.detection.features import Features
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.exposure import Exposure
from spinewatch.imaging.frame import SIDES, Frame, Side
from spinewatch.rig_files.rig_json import parse_rig
from tests.paths import SAMPLES

D1 = SAMPLES / "D1"
BALL = (9.1, 10.8)
RANGES_MM = (711.0, 695.8)


def stage(name: str) -> Iterator[tuple[Side, NDArray[Any], tuple[float, float], NDArray[np.float64]]]:
    folder = D1 / name
    truth = json.loads((folder / "truth.json").read_text())
    sizes = nominal_ball_px(parse_rig((D1 / "rig.json").read_bytes()), RANGES_MM, 8.0)
    for side, size in zip(SIDES, sizes, strict=True):
        balls = [b[side] for t in truth["triads"] for b in t["balls"].values() if b[side]["visible"]]
        image = decode_image((folder / f"{side}.png").read_bytes())
        yield side, image, size, np.array([b["center_px"] for b in balls])


def recall(features: Features, centres: NDArray[np.float64], within_px: float = 1.5) -> float:
    distance = np.linalg.norm(features.xy_px[None] - centres[:, None], axis=2)
    return float((distance.min(axis=1) < within_px).mean())


@pytest.mark.parametrize("name", ["PRE", "INTER", "POST"])
def test_every_visible_ball_is_among_sixty_features_and_in_the_field(name: str) -> None:
    for side, image, ball, centres in stage(name):
        found = detect(Frame(image, side), ball, replace(DetectionParameters(), max_features=60))
        assert recall(found.features, centres) == 1
        assert found.field.contains(centres).all()
        assert np.all(np.diff(found.features.score) <= 0)


@pytest.mark.parametrize("darken", [0.25, 0.06])
def test_dark_images_in_sixteen_bits_are_as_good(darken: float) -> None:
    for side, image, ball, centres in stage("PRE"):
        dark = np.round(image * (65535 / 255) * darken).astype(np.uint16)
        assert recall(detect(Frame(dark, side), ball, DetectionParameters()).features, centres) >= 0.95


def test_a_larger_image_is_searched_in_its_own_pixels() -> None:
    for side, image, (across, down), centres in stage("PRE"):
        large = np.kron(image, np.ones((3, 3), dtype=np.uint8))
        found = detect(Frame(large, side), (3 * across, 3 * down), DetectionParameters())
        assert recall(found.features, 3 * centres + 1, within_px=4) >= 0.95


def test_detection_is_reproducible_to_the_bit() -> None:
    side, image, ball, _ = next(iter(stage("POST")))
    first, second = (detect(Frame(image, side), ball, DetectionParameters()).features for _ in range(2))
    assert np.array_equal(first.xy_px, second.xy_px)
    assert np.array_equal(first.score, second.score)


@settings(max_examples=60, deadline=None)
@given(
    hnp.arrays(
        st.sampled_from([np.uint8, np.uint16]),
        hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=40),
    ),
    st.sampled_from(["left", "right"]),
)
def test_any_image_gives_finite_features_or_none_with_a_flag(image: NDArray[Any], side: Side) -> None:
    found = detect(Frame(image, side), BALL, DetectionParameters())
    assert np.isfinite(found.features.xy_px).all()
    assert np.isfinite(found.features.score).all()
    assert len(found.features) or found.flags


@pytest.mark.parametrize("level", [0, 128, 255])
def test_a_blank_image_has_a_flag(level: int) -> None:
    found = detect(Frame(np.full((416, 568), level, np.uint8), "left"), BALL, DetectionParameters())
    assert found.exposure is Exposure.BLANK
    assert len(found.features) == 0
    assert [flag.code for flag in found.flags] == ["blank-image"]


def test_a_prepared_search_finds_the_same_in_every_image_of_its_view() -> None:
    parameters = DetectionParameters()
    for name in ("PRE", "POST"):
        for side, image, ball, _ in stage(name):
            frame = Frame(image, side)
            prepared = prepare_search(side, ball, frame.size_px, parameters).detect(frame).features
            assert np.array_equal(prepared.xy_px, detect(frame, ball, parameters).features.xy_px)


def test_the_given_template_set_is_used() -> None:
    ours = default_template_set()
    swapped = {
        (other, space): ours.trees[side, space]
        for side, other in zip(SIDES, SIDES[::-1], strict=True)
        for space in PropertySpace
    }
    side, image, ball, _ = next(iter(stage("PRE")))
    frames = Frame(image, side), ball, DetectionParameters()
    found, other = (
        detect(*frames).features,
        detect(*frames, TemplateSet("swapped", ours.diameter_px, swapped)).features,
    )
    assert not np.array_equal(found.score[:10], other.score[:10])
