import numpy as np
import pytest

from spinewatch.calibration.cameras import calibrate_cameras
from spinewatch.calibration.errors import (
    ImplausibleCalibrationError,
    PixelSizeError,
    PlanarFieldError,
    PointsError,
    TooFewPointsError,
)
from spinewatch.calibration.plausibility.limits import CalibrationLimits
from spinewatch.calibration.points import ImagePoints, Sensor
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.simulation.rigs import converging_rig
from tests.spinewatch.calibration.simulated import FIELD, IDENTITY, WIDE, WIDE_SENSOR, image

THIRD = converging_rig(300.0, 18.0, target_mm=(317.5, 254.0, 40.0)).left
CAMERAS = {"a": WIDE.left, "b": WIDE.right, "c": THIRD}
WIDE_BORDER = CalibrationLimits(border_px=100.0)
"""Some points are simulated outside the image."""

SHIFTED = RigidTransform(np.eye(3), np.array([10.0, -15.0, 5.0]))


def test_three_cameras_and_two_shots_are_solved_exactly_and_connected_by_the_placement() -> None:
    shots = {"1": IDENTITY, "2": SHIFTED}
    result = calibrate_cameras(
        {
            name: {shot: image(camera, FIELD.ids, placement) for shot, placement in shots.items()}
            for name, camera in CAMERAS.items()
        },
        WIDE_SENSOR,
        plausibility=WIDE_BORDER,
    )
    for name, true in CAMERAS.items():
        assert result.cameras[name].position_mm == pytest.approx(true.position_mm, abs=1e-4)
        assert set(result.sd(name)) >= {"X0", "f"}
    assert result.adjustment.block.placements[1].translation_mm == pytest.approx([10, -15, 5], abs=1e-5)
    assert set(result.pairs) == {("a", "b"), ("a", "c"), ("b", "c")}


def test_a_placement_that_only_the_second_camera_has_in_view_is_found() -> None:
    seen = {"a": {"1": image(WIDE.left, FIELD.ids)}, "b": {"1": image(WIDE.right, FIELD.ids)}}
    seen["b"]["2"] = image(WIDE.right, FIELD.ids, SHIFTED)
    result = calibrate_cameras(seen, WIDE_SENSOR, plausibility=WIDE_BORDER)
    placements = result.adjustment.block.placements
    assert placements[1].translation_mm == pytest.approx([10, -15, 5], abs=1e-5)


def test_one_camera_is_enough_and_has_no_pairs() -> None:
    result = calibrate_cameras({"a": {"1": image(WIDE.left, FIELD.ids, sigma_px=0.05)}}, WIDE_SENSOR)
    assert result.adjustment.rms_px == pytest.approx(0.05, abs=0.02)
    assert not result.pairs


def test_what_cannot_be_solved_names_the_camera() -> None:
    good = image(WIDE.left, FIELD.ids)
    with pytest.raises(TooFewPointsError, match="no image point"):
        calibrate_cameras({}, WIDE_SENSOR)
    with pytest.raises(TooFewPointsError, match="camera b has 3 points of shot 1"):
        calibrate_cameras({"a": {"1": good}, "b": {"1": good.keep(np.arange(30) < 3)}}, WIDE_SENSOR)
    flat = good.keep(np.isclose(FIELD.points_mm[:, 2], 45, atol=0.4))
    with pytest.raises(PlanarFieldError, match="camera b"):
        calibrate_cameras({"a": {"1": good}, "b": {"1": flat}}, WIDE_SENSOR)
    other = ImagePoints.build(FIELD.ids, FIELD.points_mm + np.eye(30, 3), good.pixels)
    with pytest.raises(PointsError, match="point 1 has other object coordinates in b than in a"):
        calibrate_cameras({"a": {"1": good}, "b": {"1": other}}, WIDE_SENSOR)


def test_implausible_cameras_are_refused() -> None:
    good = image(WIDE.left, FIELD.ids, sigma_px=0.05)
    metres = ImagePoints.build(good.ids, good.control_mm / 1000, good.pixels)
    with pytest.raises(ImplausibleCalibrationError, match="metres"):
        calibrate_cameras({"a": {"1": metres}}, WIDE_SENSOR)
    with pytest.raises(PixelSizeError, match="in micrometres"):
        calibrate_cameras({"a": {"1": good}}, Sensor(WIDE_SENSOR.image_size_px, (10.0, 8.45)))
    double = ImagePoints.build(good.ids, good.control_mm, 2 * good.pixels)
    with pytest.raises(PointsError, match=r"camera a, shot 1: point .* outside the image"):
        calibrate_cameras({"a": {"1": double}}, WIDE_SENSOR)
