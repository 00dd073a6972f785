from typing import Any, Literal

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spinewatch.arrays import Float, Pixels
from spinewatch.calibration.control_field import ControlField
from spinewatch.calibration.errors import (
    BoardOrientationError,
    CalibrationError,
    IdentificationError,
    MirroredFieldError,
    TargetsNotFoundError,
)
from spinewatch.calibration.marks.detection import Targets, find_targets
from spinewatch.calibration.marks.identification import identify_targets
from spinewatch.calibration.points import Sensor
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.simulation.board_images import BoardStyle, render_board
from tests.spinewatch.calibration.simulated import FIELD, TABLE_3_3, TYPICAL

SENSOR = Sensor.of_cart((568, 416))
Boards = dict[str, tuple[tuple[Pixels, Pixels], Any]]


def targets_at(pixels: Float) -> Targets:
    n = len(pixels)
    return Targets(pixels, np.full(n, 0.02), np.full(n, 200.0), np.full(n, 15.0))


@pytest.mark.parametrize(("mark", "angle"), [("cross", 40), ("disc", -70), ("cross", 160)])
def test_marks_of_a_rotated_board_are_identified(mark: Literal["cross", "disc"], angle: int) -> None:
    rng = np.random.default_rng(angle % 7)
    centre = np.array([317.5, 254.0, 40.0])
    R = Rotation.from_euler("zyx", [angle, 3, -2], degrees=True).as_matrix()
    placement = RigidTransform(R, np.array([440.0, 385.0, 30.0]) - R @ centre)
    camera = TABLE_3_3.right
    style = BoardStyle(mark=mark, mark_mm=11 if mark == "cross" else 10, samples=3)
    found = find_targets(render_board(camera, FIELD, placement, rng, style))
    points = identify_targets(found, FIELD, SENSOR).points
    true = camera.project(placement(FIELD.take(points.ids)))
    assert len(points) >= 9
    assert np.sqrt(np.mean((points.pixels - true) ** 2)) < 0.05


@pytest.mark.parametrize("mark", ["disc", "cross"])
def test_marks_on_a_board_as_white_as_its_pegs_are_identified(mark: Literal["cross", "disc"]) -> None:
    camera = TABLE_3_3.left
    placement = RigidTransform(np.eye(3), np.array([0.0, 5.0, 0.0]))
    style = BoardStyle(mark=mark, mark_mm=11, board=237, side=190, samples=3)
    found = find_targets(render_board(camera, FIELD, placement, np.random.default_rng(3), style))
    points = identify_targets(found, FIELD, SENSOR).points
    true = camera.project(placement(FIELD.take(points.ids)))
    assert len(points) >= 10
    assert np.sqrt(np.mean((points.pixels - true) ** 2)) < 0.06


def test_targets_that_are_no_control_points_are_left_out() -> None:
    stray = np.array([[100.0, 90.0], [450.0, 300.0]])
    pixels = np.concatenate([stray, TABLE_3_3.left.project(FIELD.take(TYPICAL))])
    assert set(identify_targets(targets_at(pixels), FIELD, SENSOR).points.ids) <= set(TYPICAL)


def test_too_few_targets_are_refused() -> None:
    pixels = TABLE_3_3.left.project(FIELD.take(TYPICAL[:7]))
    with pytest.raises(TargetsNotFoundError, match="the image shows 7 targets"):
        identify_targets(targets_at(pixels), FIELD, SENSOR)


def test_a_board_of_equal_pegs_is_ambiguous() -> None:
    x, y = np.meshgrid(127.0 * np.arange(8), 127.0 * np.arange(7))
    heights = 40.0 * ((np.arange(8)[None] + np.arange(7)[:, None]) % 2)
    X = np.stack([x, y, heights], axis=-1).reshape(-1, 3)
    field = ControlField("regular", tuple(map(str, range(len(X)))), X)
    camera = TABLE_3_3.left
    pixels = camera.project(X) + 0.03 * np.random.default_rng(0).standard_normal((len(X), 2))
    inside = np.all((pixels > 5) & (pixels < np.array(camera.image_size_px) - 5), axis=1)
    with pytest.raises(IdentificationError, match="two parts of the control field"):
        identify_targets(targets_at(pixels[inside]), field, SENSOR)


@pytest.mark.parametrize(
    ("axes", "error", "words"),
    [
        ((-1, 1, 1), MirroredFieldError, "only mirrored"),
        ((1, 1, -1), MirroredFieldError, "sign of every Z"),
        ((1, -1, -1), BoardOrientationError, "upside down"),
    ],
)
def test_a_field_with_other_axes_is_distinguished_from_a_wrong_one(
    boards: Boards, axes: tuple[int, int, int], error: type[CalibrationError], words: str
) -> None:
    other = ControlField("other", FIELD.ids, FIELD.points_mm * axes)
    with pytest.raises(error, match=words):
        identify_targets(find_targets(boards["C"][0][0]), other, SENSOR)


def test_flipped_images_and_wrong_heights_are_diagnosed(boards: Boards) -> None:
    left = boards["C"][0][0]
    with pytest.raises(MirroredFieldError, match="do not flip the image"):
        identify_targets(find_targets(np.fliplr(left)), FIELD, SENSOR)
    heights = np.random.default_rng(0).permutation(FIELD.points_mm[:, 2])
    wrong = ControlField("wrong", FIELD.ids, np.column_stack([FIELD.points_mm[:, :2], heights]))
    with pytest.raises(IdentificationError, match="fit no part of control field 'wrong'"):
        identify_targets(find_targets(left), wrong, SENSOR)


def test_a_large_field_is_searched_too(boards: Boards) -> None:
    rng = np.random.default_rng(2)
    beyond = rng.uniform((800, -2000, 0), (5000, 2000, 100), (270, 3))
    ids = (*FIELD.ids, *(f"x{i}" for i in range(270)))
    field = ControlField("large", ids, np.concatenate([FIELD.points_mm, beyond]))
    found = identify_targets(find_targets(boards["C"][0][0]), field, SENSOR)
    assert set(found.points.ids) <= set(FIELD.ids)
