"""Corners of chessboards and ChArUco boards in rendered images."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from spinewatch.arrays import Float, Int
from spinewatch.calibration.boards import BoardField, board_field
from spinewatch.calibration.errors import IdentificationError, PlanarFieldError, TargetsNotFoundError
from spinewatch.calibration.from_images import CalibrationParameters, calibrate_from_images
from spinewatch.calibration.marks.board_corners import BoardCornerParameters, find_corners
from spinewatch.calibration.points import ImagePoints
from spinewatch.camera import Camera
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.simulation.rigs import table_3_3_rig
from tests.spinewatch.calibration.board_pictures import placement, render

Image = NDArray[np.uint8]
RIG = table_3_3_rig()
CHARUCO = "charuco:9x7:30:22:DICT_5X5_100"
TILTS = ((10.0, 0.0, 3.0), (-24.0, 5.0, -8.0), (4.0, 24.0, 10.0), (0.0, -22.0, 5.0), (20.0, 15.0, -15.0))


def images(field: BoardField, at: RigidTransform, seed: int = 0) -> tuple[Image, Image]:
    rng = np.random.default_rng(seed)
    return render(RIG.left, field, at, rng), render(RIG.right, field, at, rng)


def true_index(
    field: BoardField, at: RigidTransform, camera: Camera, image: ImagePoints
) -> tuple[Int, Float]:
    """Return for each corner found the index of the corner that is there, and its distance, px."""
    true = camera.project(at(field.points_mm))
    d = np.linalg.norm(image.pixels[:, None] - true[None], axis=2)
    return d.argmin(axis=1), d.min(axis=1)


@pytest.mark.parametrize("name", ["chessboard:9x6:25", "chessboard:8x6:25", "chessboard:7x7:25", CHARUCO])
@pytest.mark.parametrize("roll", [0.0, 100.0, 180.0])
def test_corners_are_found_to_a_tenth_of_a_pixel_and_are_the_same_in_both_images(
    name: str, roll: float
) -> None:
    field = board_field(name)
    at = placement(field, (12.0, -8.0, roll))
    shot = find_corners(images(field, at), "1", field, BoardCornerParameters())
    (left, left_error), (right, right_error) = (
        true_index(field, at, camera, image)
        for camera, image in zip((RIG.left, RIG.right), shot.images, strict=True)
    )
    assert np.sqrt(np.mean(left_error**2)) < 0.1
    assert np.sqrt(np.mean(right_error**2)) < 0.1
    there = dict(zip(shot.left.ids, left.tolist(), strict=True))
    assert all(there.get(i, k) == k for i, k in zip(shot.right.ids, right.tolist(), strict=True))


@pytest.mark.parametrize(
    ("name", "roll"), [("chessboard:9x6:25", 0.0), ("chessboard:6x9:25", 90.0), (CHARUCO, 180.0)]
)
def test_images_of_boards_give_the_rig_with_x_to_the_right(name: str, roll: float) -> None:
    field = board_field(name)
    shots = [
        images(field, placement(field, (a, b, c + roll), (432.0 + 10 * k, 384.0, 30.0)), k)
        for k, (a, b, c) in enumerate(TILTS)
    ]
    result = calibrate_from_images(shots, field, CalibrationParameters(), verify=1)
    rig, adjustment = result.calibration.rig, result.calibration.adjustment
    assert rig.baseline_mm == pytest.approx(RIG.baseline_mm, rel=0.005)
    assert adjustment.rms_px < 0.1
    assert rig.left.M[0, 0] > 0.7
    assert rig.left.centre[2] > 300
    assert result.accuracy[-1].sd_mm.max() < 0.5


def test_large_images_are_reduced_and_corners_refined_in_the_image_itself() -> None:
    field = board_field("chessboard:9x6:25")
    at = placement(field, (12.0, -8.0, 0.0))
    pair = images(field, at)
    parameters = BoardCornerParameters(max_width_px=400)
    shot = find_corners(pair, "1", field, parameters)
    _, error = true_index(field, at, RIG.left, shot.left)
    assert np.sqrt(np.mean(error**2)) < 0.1


def test_images_of_sixteen_bits_give_the_same_corners() -> None:
    field = board_field("chessboard:9x6:25")
    pair = images(field, placement(field, (12.0, -8.0, 0.0)))
    shot = find_corners(pair, "1", field, BoardCornerParameters())
    left, right = (image.astype(np.uint16) * 200 for image in pair)
    deep = find_corners((left, right), "1", field, BoardCornerParameters())
    np.testing.assert_allclose(shot.left.pixels, deep.left.pixels, atol=0.02)


def test_an_image_without_the_board_is_refused_by_name() -> None:
    field = board_field("chessboard:9x6:25")
    pair = images(field, placement(field, (12.0, -8.0, 0.0)))
    with pytest.raises(TargetsNotFoundError, match="the right image of shot B: no chessboard of 9 x 6"):
        find_corners((pair[0], np.full_like(pair[1], 90)), "B", field, BoardCornerParameters())
    with pytest.raises(TargetsNotFoundError, match="the left image of shot B: 0 of 48 corners"):
        find_corners(pair, "B", board_field(CHARUCO), BoardCornerParameters())


def test_a_symmetric_board_rotated_by_a_quarter_between_the_images_is_refused() -> None:
    field = board_field("chessboard:8x6:25")
    at = placement(field, (5.0, 0.0, 0.0))
    left, right = images(field, at)
    turned = np.asarray(
        cv2.warpAffine(right, cv2.getRotationMatrix2D((284, 208), 90, 1.0), (568, 416), borderValue=90),
        dtype=np.uint8,
    )
    with pytest.raises(IdentificationError, match="looks the same"):
        find_corners((left, turned), "1", field, BoardCornerParameters())


def test_the_colours_of_the_squares_identify_an_even_and_odd_board_at_any_rotation() -> None:
    field = board_field("chessboard:9x6:25")
    at, flipped = (placement(field, (5.0, 0.0, roll)) for roll in (0.0, 180.0))
    upside_down = find_corners(
        (images(field, at)[0], images(field, flipped)[1]), "1", field, BoardCornerParameters()
    )
    left, _ = true_index(field, at, RIG.left, upside_down.left)
    right, _ = true_index(field, flipped, RIG.right, upside_down.right)
    assert left.tolist() == right.tolist()


def test_one_shot_of_a_board_is_refused() -> None:
    field = board_field("chessboard:9x6:25")
    pair = images(field, placement(field, TILTS[0]))
    with pytest.raises(PlanarFieldError, match="several shots"):
        calibrate_from_images([pair], field)


def test_the_same_field_without_enough_corners_is_refused() -> None:
    field = board_field(CHARUCO)
    pair = images(field, placement(field, TILTS[0]))
    parameters = replace(BoardCornerParameters(), min_corners=12)
    left, right = (np.where(np.arange(568) < 400, 90, image).astype(np.uint8) for image in pair)
    with pytest.raises(TargetsNotFoundError, match="corners of the ChArUco board"):
        find_corners((left, right), "1", field, parameters)
