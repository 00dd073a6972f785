from dataclasses import replace
from typing import Any, Literal

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spinewatch.arrays import Pixels
from spinewatch.calibration.control_field import ControlField, low_high_field, pegboard_1995
from spinewatch.calibration.errors import (
    BoardOrientationError,
    CalibrationError,
    ControlFieldError,
    IdentificationError,
    MirroredFieldError,
    PlanarFieldError,
    SidesSwappedError,
    TargetsNotFoundError,
)
from spinewatch.calibration.from_images import FromImagesParameters, calibrate_from_images
from spinewatch.calibration.marks.detection import find_targets
from spinewatch.calibration.marks.identification import identify
from spinewatch.calibration.points import Sensor
from spinewatch.calibration.solve.resection import SolveParameters
from spinewatch.errors import SameImageError
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.simulation.boards import BoardLook, draw_board
from spinewatch.simulation.rigs import table_3_3_rig

FIELD = pegboard_1995()
Boards = dict[str, tuple[tuple[Pixels, Pixels], Any]]


def test_rendered_boards_are_found_named_and_reconstructed(boards: Boards) -> None:
    names = ["C", "A", "B", "F"]
    steps = []
    result = calibrate_from_images(
        [boards[n][0] for n in names], FIELD, names=names, verify=3, progress=lambda s, f: steps.append(f)
    )
    assert steps == sorted(steps)
    assert steps[-1] == 1
    errors = []
    for shot in (*result.calibration.shots, *result.others):
        truth = boards[shot.name][1]
        assert set(truth["visible_both"]) <= set(shot.left.ids) & set(shot.right.ids)
        for side in ("left", "right"):
            image = getattr(shot, side)
            errors += [
                p - truth["points"][i][side]["center_px"]
                for i, p in zip(image.ids, image.pixels, strict=True)
            ]
    assert np.abs(errors).max() < 0.15
    assert np.sqrt(np.mean(np.square(errors))) < 0.05
    for accuracy in result.accuracy[1:3]:
        assert not accuracy.used
        assert np.all(accuracy.sd_mm < (0.04, 0.05, 0.10))
    assert result.geometry.baseline_mm == pytest.approx(421.9, abs=1.5)


@pytest.mark.parametrize(("mark", "turn"), [("cross", 40), ("disc", -70), ("cross", 160)])
def test_marks_of_a_turned_board_are_named(mark: Literal["cross", "disc"], turn: int) -> None:
    rng = np.random.default_rng(turn % 7)
    centre = np.array([317.5, 254.0, 40.0])
    R = Rotation.from_euler("zyx", [turn, 3, -2], degrees=True).as_matrix()
    place = RigidTransform(R, np.array([440.0, 385.0, 30.0]) - R @ centre)
    camera = table_3_3_rig().right
    look = BoardLook(mark=mark, mark_mm=11 if mark == "cross" else 10, samples=3)
    found = find_targets(draw_board(camera, FIELD, place, rng, look))
    points = identify(found, FIELD, Sensor.of_cart((568, 416))).points
    true = camera.project(place(FIELD.take(points.ids)))
    assert len(points) >= 9
    assert np.sqrt(np.mean((points.pixels - true) ** 2)) < 0.05


@pytest.mark.parametrize("mark", ["disc", "cross"])
def test_marks_on_a_board_as_white_as_its_pegs_are_named(mark: Literal["cross", "disc"]) -> None:
    camera = table_3_3_rig().left
    place = RigidTransform(np.eye(3), np.array([0.0, 5.0, 0.0]))
    look = BoardLook(mark=mark, mark_mm=11, board=237, side=190, samples=3)
    found = find_targets(draw_board(camera, FIELD, place, np.random.default_rng(3), look))
    points = identify(found, FIELD, Sensor.of_cart((568, 416))).points
    true = camera.project(place(FIELD.take(points.ids)))
    assert len(points) >= 10
    assert np.sqrt(np.mean((points.pixels - true) ** 2)) < 0.06


def test_an_unknown_aspect_is_estimated_from_pictures(boards: Boards) -> None:
    square = FromImagesParameters(pixel_size_mm=(0.01, 0.01))
    with pytest.raises(IdentificationError, match="aspect"):
        calibrate_from_images([boards["C"][0]], FIELD, square)
    estimated = replace(square, solve=SolveParameters(estimate_aspect=True))
    rig = calibrate_from_images([boards["C"][0]], FIELD, estimated).calibration.rig
    for camera in (rig.left, rig.right):
        assert camera.pixel_size_mm[1] / camera.pixel_size_mm[0] == pytest.approx(0.845, abs=0.004)


def test_bad_pictures_and_fields_are_named(boards: Boards) -> None:
    left, right = boards["C"][0]
    with pytest.raises(SidesSwappedError):
        calibrate_from_images([(right, left)], FIELD)
    with pytest.raises(SameImageError):
        calibrate_from_images([(left, left)], FIELD)
    with pytest.raises(BoardOrientationError):
        calibrate_from_images([(np.rot90(left, 2), np.rot90(right, 2))], FIELD)
    with pytest.raises(TargetsNotFoundError, match="left picture of shot 1"):
        calibrate_from_images([(np.full_like(left, 90), right)], FIELD)
    flat = ControlField("flat", FIELD.ids, FIELD.points_mm * (1, 1, 0))
    with pytest.raises(PlanarFieldError):
        calibrate_from_images([(left, right)], flat)
    heights = np.random.default_rng(0).permutation(FIELD.points_mm[:, 2])
    wrong = ControlField("wrong", FIELD.ids, np.column_stack([FIELD.points_mm[:, :2], heights]))
    with pytest.raises(IdentificationError, match="wrong"):
        calibrate_from_images([(left, right)], wrong)


@pytest.mark.parametrize(
    ("axes", "error", "words"),
    [
        ((-1, 1, 1), MirroredFieldError, "only mirrored"),
        ((1, 1, -1), MirroredFieldError, "sign of every Z"),
        ((1, -1, -1), BoardOrientationError, "upside down"),
    ],
)
def test_a_field_with_other_axes_is_told_from_a_wrong_one(
    boards: Boards, axes: tuple[int, int, int], error: type[CalibrationError], words: str
) -> None:
    turned = ControlField("turned", FIELD.ids, FIELD.points_mm * axes)
    with pytest.raises(error, match=words):
        calibrate_from_images([boards["C"][0]], turned)


def test_pictures_that_were_flipped_are_named(boards: Boards) -> None:
    left, right = boards["C"][0]
    with pytest.raises(MirroredFieldError, match="do not flip the picture"):
        calibrate_from_images([(np.fliplr(left), np.fliplr(right))], FIELD)


def test_a_large_field_is_searched_too_and_one_too_large_refused(boards: Boards) -> None:
    rng = np.random.default_rng(2)

    def field(extra: int) -> ControlField:
        beyond = rng.uniform((800, -2000, 0), (5000, 2000, 100), (extra, 3))
        ids = (*FIELD.ids, *(f"x{i}" for i in range(extra)))
        return ControlField("large", ids, np.concatenate([FIELD.points_mm, beyond]))

    found = identify(find_targets(boards["C"][0][0]), field(270), Sensor.of_cart((568, 416)))
    assert set(found.points.ids) <= set(FIELD.ids)
    with pytest.raises(ControlFieldError, match="at most 500"):
        calibrate_from_images([boards["C"][0]], field(471))


def test_fields_refuse_doubles_and_not_a_number() -> None:
    points = FIELD.points_mm.copy()
    with pytest.raises(ControlFieldError, match="twice"):
        ControlField("f", ("1", *FIELD.ids[:-1]), points)
    points[3] = points[2]
    with pytest.raises(ControlFieldError, match="same coordinates"):
        ControlField("f", FIELD.ids, points)
    points[3, 0] = np.nan
    with pytest.raises(ControlFieldError, match="not a number"):
        ControlField("f", FIELD.ids, points)


def test_designed_boards_alternate_low_and_high_inside_a_low_rim() -> None:
    heights = low_high_field(5, 6, 127.0, np.random.default_rng(0)).points_mm[:, 2].reshape(5, 6)
    inside = heights[1:-1, 1:-1] >= 60
    assert np.all(inside[:, 1:] != inside[:, :-1])
    assert np.all(inside[1:] != inside[:-1])
    assert np.all(heights[[0, -1]] <= 45)
    assert np.all(heights[:, [0, -1]] <= 45)
