from dataclasses import replace

import pytest

from spinewatch.calibration.errors import ImplausibleCalibrationError
from spinewatch.calibration.plausibility.cameras import aspect_doubts, check_cameras, principal_point_doubts
from spinewatch.calibration.plausibility.limits import CalibrationLimits
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.calibration.stereo import StereoCalibration, calibrate_stereo
from tests.spinewatch.calibration.simulated import SENSOR, SENSORS, stereo_shot

PARAMETERS = CalibrationLimits()

NAMES = ("left", "right")


def changed(shot: Shot, control: float = 1.0, pixels: float = 1.0) -> Shot:
    """The shot with its object or image coordinates scaled."""
    left, right = (
        ImagePoints.build(image.ids, control * image.control_mm, pixels * image.pixels)
        for image in shot.images
    )
    return Shot(shot.name, left, right)


def solved(shot: Shot, sensors: tuple[Sensor, Sensor] = SENSORS) -> StereoCalibration:
    return calibrate_stereo([shot], sensors)


@pytest.mark.parametrize(
    ("factor", "unit"), [(0.001, "metres"), (0.1, "inches or centimetres"), (1 / 25.4, "inches")]
)
def test_the_unit_of_the_control_field_follows_from_the_range(factor: float, unit: str) -> None:
    shot = stereo_shot(sigma_px=0.03)
    check_cameras(NAMES, solved(shot).adjustment, PARAMETERS, is_rig=True)
    with pytest.raises(ImplausibleCalibrationError, match=f"control points in {unit}\\?"):
        check_cameras(NAMES, solved(changed(shot, control=factor)).adjustment, PARAMETERS, is_rig=True)


def test_the_baseline_of_a_rig_alone_is_limited() -> None:
    wide = replace(PARAMETERS, baseline_mm=(50.0, 400.0))
    adjustment = solved(stereo_shot()).adjustment
    check_cameras(NAMES, adjustment, wide, is_rig=False)
    with pytest.raises(ImplausibleCalibrationError, match="the baseline is 422 mm, outside 50 to 400 mm"):
        check_cameras(NAMES, adjustment, wide, is_rig=True)


def test_points_of_a_halved_image_are_refused_by_the_principal_point() -> None:
    half = solved(changed(stereo_shot(sigma_px=0.03), pixels=0.5)).adjustment
    with pytest.raises(ImplausibleCalibrationError, match=r"centre of an image of about 2.. x .* 568 x 416"):
        check_cameras(NAMES, half, PARAMETERS, is_rig=True)


def test_a_principal_point_aside_is_flagged() -> None:
    adjustment = solved(stereo_shot(sigma_px=0.03)).adjustment
    assert not principal_point_doubts(adjustment, NAMES, PARAMETERS)
    narrow = replace(PARAMETERS, principal_point=0.005)
    flags = principal_point_doubts(adjustment, NAMES, narrow)
    assert {flag.code for flag in flags} == {"calibration-poor"}


def test_another_aspect_is_flagged_with_both_numbers() -> None:
    shot = stereo_shot(sigma_px=0.03)
    assert not aspect_doubts(solved(shot).adjustment, NAMES, PARAMETERS)
    px, py = SENSOR.pixel_size_mm
    wrong = Sensor(SENSOR.image_size_px, (px, 1.02 * py))
    flags = aspect_doubts(solved(shot, (wrong, wrong)).adjustment, NAMES, PARAMETERS)
    assert {flag.code for flag in flags} == {"pixel-size-doubtful"}
    assert "0.8619 was assumed" in flags[0].detail
    estimated = calibrate_stereo([shot], (wrong, wrong), SolveParameters(estimate_aspect=True))
    assert not aspect_doubts(estimated.adjustment, NAMES, PARAMETERS)
