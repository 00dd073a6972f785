from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spinewatch.arrays import Pixels
from spinewatch.calibration.control_field import ControlField
from spinewatch.calibration.errors import (
    BoardOrientationError,
    CalibrationError,
    ControlFieldError,
    IdentificationError,
    PlanarFieldError,
    SidesSwappedError,
    TargetsNotFoundError,
)
from spinewatch.calibration.from_images import (
    CalibrationParameters,
    calibrate_from_images,
    calibrate_from_points,
)
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.errors import ImageSizeError, SameImageError
from tests.spinewatch.calibration.simulated import FIELD, SENSORS, TABLE_3_3, moved_board, stereo_shot

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
    for shot in (*result.calibration.shots, *result.held_out):
        truth = boards[shot.name][1]
        assert set(truth["visible_both"]) <= set(shot.left.ids) & set(shot.right.ids)
        for side, image in zip(("left", "right"), shot.images, strict=True):
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


def test_coordinates_become_a_rig_with_its_quality() -> None:
    shots = [
        stereo_shot(sigma_px=0.05),
        stereo_shot("fresh", placement=moved_board(1), sigma_px=0.05, seed=9),
    ]
    result = calibrate_from_points(shots, FIELD, SENSORS, CalibrationParameters(f_number=8.0), verify=1)
    assert [(a.name, a.used) for a in result.accuracy] == [("C", True), ("fresh", False)]
    assert result.leave_one_out is not None
    assert result.geometry.f_number == 8.0
    assert abs(result.geometry.baseline_mm - TABLE_3_3.baseline_mm) < 4 * result.geometry.baseline_sd_mm


def test_an_unknown_aspect_is_estimated_from_images(boards: Boards) -> None:
    square = CalibrationParameters(pixel_size_mm=(0.01, 0.01))
    with pytest.raises(IdentificationError, match="aspect"):
        calibrate_from_images([boards["C"][0]], FIELD, square)
    estimated = replace(square, solve=SolveParameters(estimate_aspect=True))
    rig = calibrate_from_images([boards["C"][0]], FIELD, estimated).calibration.rig
    for camera in (rig.left, rig.right):
        assert camera.pixel_size_mm[1] / camera.pixel_size_mm[0] == pytest.approx(0.845, abs=0.004)


def test_bad_images_are_named(boards: Boards) -> None:
    left, right = boards["C"][0]
    with pytest.raises(CalibrationError, match="no image was given"):
        calibrate_from_images([], FIELD)
    with pytest.raises(SidesSwappedError):
        calibrate_from_images([(right, left)], FIELD)
    with pytest.raises(SameImageError):
        calibrate_from_images([(left, left)], FIELD)
    with pytest.raises(ImageSizeError, match="shot 2: the right image is 568 x 400"):
        calibrate_from_images([(left, right), (left, right[:400])], FIELD)
    with pytest.raises(BoardOrientationError):
        calibrate_from_images([(np.rot90(left, 2), np.rot90(right, 2))], FIELD)
    with pytest.raises(TargetsNotFoundError, match="left image of shot 1"):
        calibrate_from_images([(np.full_like(left, 90), right)], FIELD)


def test_flat_and_oversized_fields_are_refused(boards: Boards) -> None:
    flat = ControlField("flat", FIELD.ids, FIELD.points_mm * (1, 1, 0))
    with pytest.raises(PlanarFieldError):
        calibrate_from_images([boards["C"][0]], flat)
    ids = tuple(map(str, range(501)))
    with pytest.raises(ControlFieldError, match="at most 500"):
        calibrate_from_images(
            [boards["C"][0]], ControlField("large", ids, np.random.default_rng(0).uniform(0, 900, (501, 3)))
        )
