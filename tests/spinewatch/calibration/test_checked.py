from dataclasses import replace

import pytest

from spinewatch.calibration.checked import calibrate_checked, doubt_flags
from spinewatch.calibration.errors import (
    ConvergenceError,
    ImplausibleCalibrationError,
    PixelSizeError,
    PoorFitError,
    ShotsDisagreeError,
)
from spinewatch.calibration.plausibility.limits import CalibrationLimits
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.solve.parameters import SolveParameters
from tests.spinewatch.calibration.simulated import SENSOR, SENSORS, TABLE_3_3, moved_board, stereo_shot


def shots(n: int) -> list[Shot]:
    """Sound shots of a board that is moved between them."""
    first = stereo_shot("1", sigma_px=0.03)
    others = [
        stereo_shot(str(k + 1), placement=moved_board(k, 3.0, 8.0), sigma_px=0.03, seed=k)
        for k in range(1, n)
    ]
    return [first, *others]


def test_sound_shots_become_a_rig_without_doubts() -> None:
    calibration = calibrate_checked(shots(2), SENSORS, name="cart 2")
    assert calibration.rig.name == "cart 2"
    assert calibration.rig.baseline_mm == pytest.approx(TABLE_3_3.baseline_mm, abs=3)
    assert doubt_flags(calibration) == ()


def test_images_in_the_order_left_left_right_right_are_named() -> None:
    a, b = shots(2)
    with pytest.raises(ShotsDisagreeError, match="left images come before all right ones"):
        calibrate_checked([Shot("1", a.left, b.left), Shot("2", a.right, b.right)], SENSORS)


def test_exchanged_sides_of_one_shot_are_named() -> None:
    a, b = shots(2)
    with pytest.raises(ShotsDisagreeError, match="left and right of shot 2 are exchanged"):
        calibrate_checked([a, Shot("2", b.right, b.left)], SENSORS)


def test_left_images_of_two_shots_that_are_exchanged_are_named() -> None:
    a, b = shots(2)
    with pytest.raises(ShotsDisagreeError, match="left images of shots 1 and 2"):
        calibrate_checked([Shot("1", b.left, a.right), Shot("2", a.left, b.right)], SENSORS)


def test_a_shot_of_two_moments_is_named_among_three_and_refused_among_two() -> None:
    a, b, c = shots(3)
    other = stereo_shot("x", placement=moved_board(7, 2.0, 6.0), sigma_px=0.03)
    mixed = Shot("2", b.left, other.right)
    with pytest.raises(ShotsDisagreeError, match="all but shot 2 agree"):
        calibrate_checked([a, mixed, c], SENSORS)
    with pytest.raises(ShotsDisagreeError, match="both of the same moment"):
        calibrate_checked([a, mixed], SENSORS)


def test_without_alternatives_the_reasons_are_given() -> None:
    a, b = shots(2)
    with pytest.raises((ShotsDisagreeError, PoorFitError, ConvergenceError)) as raised:
        calibrate_checked(
            [a, Shot("2", b.right, b.left)],
            SENSORS,
            SolveParameters(check_orientation=False),
            CalibrationLimits(max_alternatives=0),
        )
    assert "exchanged" not in str(raised.value)


def test_a_wrong_aspect_that_spoils_the_fit_is_named() -> None:
    square = Sensor(SENSOR.image_size_px, (0.01, 0.01))
    with pytest.raises(PixelSizeError, match=r"aspect .* of 0.84., that of 0.01 x 0.01 mm is 1.000"):
        calibrate_checked([stereo_shot(sigma_px=0.03)], (square, square))


def test_a_small_error_of_the_aspect_is_flagged() -> None:
    wrong = Sensor(SENSOR.image_size_px, (0.01, 1.012 * 0.00845))
    calibration = calibrate_checked([stereo_shot(sigma_px=0.02)], (wrong, wrong))
    assert "pixel-size-doubtful" in {flag.code for flag in doubt_flags(calibration)}


def test_a_rig_that_one_shot_leaves_open_is_refused() -> None:
    strict = CalibrationLimits(baseline_sd=1e-6)
    with pytest.raises(ImplausibleCalibrationError, match="the calibration determines no rig: baseline 42"):
        calibrate_checked([stereo_shot(sigma_px=0.05)], SENSORS, parameters=strict)
    loose = calibrate_checked([stereo_shot(sigma_px=0.05)], SENSORS)
    flags = doubt_flags(loose, replace(strict, baseline_sd=0.01))
    assert {flag.code for flag in flags} <= {"calibration-poor"}


def test_metres_are_refused() -> None:
    left, right = (
        ImagePoints.build(image.ids, image.control_mm / 1000, image.pixels)
        for image in stereo_shot(sigma_px=0.03).images
    )
    with pytest.raises(ImplausibleCalibrationError, match="metres"):
        calibrate_checked([Shot("1", left, right)], SENSORS)
