import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import SIDES, Frame
from spinewatch.thesis_1995.detect_point import (
    DetectPoint,
    DetectPointParameters,
    component_centroids,
    detect_point,
    feature_pixels,
)
from spinewatch.thesis_1995.preprocessing import PreprocessingParameters
from tests.paths import SAMPLES

BALL_PX = (9.1, 10.8)
WHOLE_IMAGE = DetectPointParameters(
    preprocessing=PreprocessingParameters(statistic=None), expected_features=60
)


def detected(stage: str, parameters: DetectPointParameters) -> list[tuple[DetectPoint, np.ndarray]]:
    """The result in both views and the visible balls."""
    folder = SAMPLES / "D1" / stage
    truth = json.loads((folder / "truth.json").read_text())
    found = []
    for side in SIDES:
        balls = [b[side] for t in truth["triads"] for b in t["balls"].values() if b[side]["visible"]]
        frame = Frame(decode_image((folder / f"{side}.png").read_bytes()), side)
        found.append((detect_point(frame, BALL_PX, parameters), np.array([b["center_px"] for b in balls])))
    return found


def recall(result: DetectPoint, centres_px: np.ndarray) -> float:
    distance = np.linalg.norm(result.features.xy_px[None] - centres_px[:, None], axis=2).min(axis=1)
    return float((distance < 1.5).mean())


def test_most_balls_of_a_stage_without_templates_of_its_own_are_found() -> None:
    assert np.mean([recall(*view) for view in detected("POST", WHOLE_IMAGE)]) > 0.8


def test_the_decision_spaces_and_the_feature_space_follow_their_equations() -> None:
    result, _ = detected("PRE", WHOLE_IMAGE)[0]
    mean = (result.gray_decision + 2 * result.edge_decision) / 3
    assert result.feature_space == pytest.approx(mean, abs=1e-6)
    kept = result.feature_pixels > 0
    assert kept.sum() <= 360
    assert result.feature_space[kept].min() >= result.feature_space[~kept].max()


def test_positions_are_those_of_the_whole_image() -> None:
    whole, centres = detected("POST", WHOLE_IMAGE)[1]
    reduced, _ = detected("POST", replace(WHOLE_IMAGE, preprocessing=PreprocessingParameters()))[1]
    first, last = reduced.preprocessed.rows
    assert 0 < first < last < len(whole.feature_space)
    v = reduced.features.xy_px[:, 1]
    assert np.all((v >= first) & (v < last))
    inside = centres[(centres[:, 1] > first + 10) & (centres[:, 1] < last - 10)]
    assert recall(reduced, inside) > 0.7


@given(st.lists(st.floats(0, 1), min_size=1, max_size=60), st.integers(1, 60))
def test_no_more_pixels_are_kept_than_admitted_unless_the_highest_level_alone_has_more(
    values: list[float], admitted: int
) -> None:
    space = np.array([values])
    kept = feature_pixels(space, admitted)
    assert np.all((kept == 0) | (kept == space))
    highest = np.rint(space * 255).max()
    assert (kept > 0).sum() <= max(admitted, (np.rint(space * 255) == highest).sum())


def test_an_empty_feature_space_has_no_features() -> None:
    assert len(component_centroids(feature_pixels(np.zeros((5, 5)), 3))[0]) == 0


@settings(max_examples=30, deadline=None)
@given(
    hnp.arrays(
        st.sampled_from([np.uint8, np.uint16]),
        hnp.array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=40),
    )
)
def test_any_image_gives_finite_features_or_none(image: NDArray[Any]) -> None:
    features = detect_point(Frame(image, "left"), BALL_PX, DetectPointParameters()).features
    assert np.isfinite(features.xy_px).all()
    assert np.isfinite(features.score).all()
