"""Rows displaced to the side are found with place and size; edges, periodic textures and noise are no displacement."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from spinewatch.imaging.displaced_rows import RowDisplacementParameters, displaced_rows
from spinewatch.imaging.level_differences import Bytes
from tests.spinewatch.imaging.degraded import Change, fields_apart, jpeg, noisy, sample, whole

PARAMETERS = RowDisplacementParameters()


def torn(levels: Bytes, row: int, shift: int) -> Bytes:
    return np.vstack([levels[:row], np.roll(levels[row:], shift, axis=1)])


@pytest.mark.parametrize("shift", [-30, -3, 2, 6, 12])
@pytest.mark.parametrize("stage", ["PRE", "INTER", "POST"])
def test_a_displacement_is_found_with_its_row_and_size(stage: str, shift: int) -> None:
    found = displaced_rows(torn(whole(sample(stage)), 207, shift), PARAMETERS)
    assert found is not None
    assert (found.row, found.shift_px) == (207, shift)
    assert found.after > found.before + PARAMETERS.min_gain


def test_a_displaced_band_is_found_at_one_of_its_edges() -> None:
    levels = whole(sample())
    found = displaced_rows(torn(torn(levels, 150, 5), 190, -5), PARAMETERS)
    assert found is not None
    assert (found.row, found.shift_px) in {(150, 5), (190, -5)}


SOUND: dict[str, Change] = {
    "as it is": lambda image: image,
    "dark": lambda image: image * 0.15,
    "noise": noisy,
    "defocus": lambda image: cv2.GaussianBlur(image, (0, 0), 3),
    "JPEG of quality 20": jpeg(20),
    "transposed": np.transpose,
    "two fields": fields_apart(3),
    "doubled rows": lambda image: np.repeat(image[::2], 2, axis=0),
}


@pytest.mark.parametrize("change", SOUND.values(), ids=SOUND.keys())
@pytest.mark.parametrize("side", ["left", "right"])
def test_sound_rows_are_not_displaced(side: str, change: Change) -> None:
    assert displaced_rows(whole(change(sample("POST", side))), PARAMETERS) is None


@pytest.mark.parametrize("blur_px", [0.0, 0.5, 1.0])
def test_a_straight_horizontal_edge_is_no_displacement(blur_px: float) -> None:
    rng = np.random.default_rng(3)
    image = sample()
    plate = 90 + 40 * cv2.GaussianBlur(rng.normal(0, 1, image.shape).astype(np.float32), (0, 0), 1.5)
    image[207:] = plate[207:]
    if blur_px:
        image = np.asarray(cv2.GaussianBlur(image, (0, 0), blur_px), np.float32)
    assert displaced_rows(whole(image + rng.normal(0, 1.5, image.shape)), PARAMETERS) is None


@pytest.mark.parametrize("square", [7, 12, 20])
def test_squares_of_a_board_in_line_with_the_rows_are_no_displacement(square: int) -> None:
    v, u = np.mgrid[:416, :568] // square
    board = np.where((u + v) % 2, 210.0, 40.0) + np.random.default_rng(4).normal(0, 2, (416, 568))
    assert displaced_rows(whole(board), PARAMETERS) is None


def test_a_narrow_image_is_not_judged() -> None:
    assert displaced_rows(torn(whole(sample())[:, :300], 207, 6), PARAMETERS) is None
