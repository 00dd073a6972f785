"""The width of edges grows with blur, along the direction of the blur."""

from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from spinewatch.imaging.sharpness import SharpnessParameters, edge_widths_px

PARAMETERS = SharpnessParameters()
BALLS = np.array([(x, y) for y in (30, 70, 110) for x in (30, 70, 110, 150)], dtype=np.float64)
BALL_PX = (9.0, 10.7)


def balls() -> NDArray[np.float32]:
    u, v = np.meshgrid(np.arange(180), np.arange(140))
    image = np.full(u.shape, 180, np.float32)
    for x, y in BALLS:
        image[((u - x) / 4.5) ** 2 + ((v - y) / 5.35) ** 2 < 1] = 40
    return np.asarray(cv2.GaussianBlur(image, (0, 0), 0.6), dtype=np.float32)


def widths(image: NDArray[Any]) -> tuple[float, float]:
    found = edge_widths_px(np.rint(image).astype(np.uint8), BALLS, BALL_PX, PARAMETERS)
    assert found is not None
    return found


def test_sharp_balls_are_within_the_limit() -> None:
    assert max(widths(balls())) < PARAMETERS.max_width_px


def test_width_grows_with_defocus() -> None:
    series = [min(widths(cv2.GaussianBlur(balls(), (0, 0), sigma))) for sigma in (1.0, 1.5, 2.0)]
    assert PARAMETERS.max_width_px < series[0] < series[1] < series[2]


@pytest.mark.parametrize("axis", [0, 1])
def test_motion_widens_edges_along_its_direction_only(axis: int) -> None:
    kernel = np.full((1, 6) if axis == 0 else (6, 1), 1 / 6)
    moved = widths(cv2.filter2D(balls(), -1, kernel))
    assert moved[axis] > PARAMETERS.max_width_px
    assert moved[axis] > 1.3 * moved[1 - axis]


def test_sixteen_bits_have_the_same_widths() -> None:
    image = np.rint(balls())
    deep = edge_widths_px((image * 257).astype(np.uint16), BALLS, BALL_PX, PARAMETERS)
    assert deep == pytest.approx(widths(image))


def test_too_few_features_have_no_width() -> None:
    image = np.rint(balls()).astype(np.uint8)
    assert edge_widths_px(image, BALLS[:3], BALL_PX, PARAMETERS) is None
    assert edge_widths_px(image, np.empty((0, 2)), BALL_PX, PARAMETERS) is None
    assert edge_widths_px(image, np.full((9, 2), 1.0), BALL_PX, PARAMETERS) is None
