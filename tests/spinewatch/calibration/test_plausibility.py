from dataclasses import replace

import numpy as np
import pytest

from spinewatch.calibration.errors import ImplausibleCalibrationError, PixelSizeError, PointsError
from spinewatch.calibration.plausibility import (
    PlausibilityParameters,
    aspect_doubts,
    baseline_sd_mm,
    check_cameras,
    check_image_points,
    check_sensor,
    fit_doubts,
    fit_limits,
    principal_point_doubts,
    repeated_shots,
)
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.quality.rig_samples import sample_rigs
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.calibration.stereo import StereoCalibration, calibrate_stereo
from tests.spinewatch.calibration.simulated import SENSOR, SENSORS, TYPICAL, moved_board, stereo_shot

PARAMETERS = PlausibilityParameters()
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
    ("factor", "unit"), [(1000.0, "micrometres"), (0.001, "metres"), (20.0, "give it in mm")]
)
def test_a_pixel_size_in_another_unit_is_refused(factor: float, unit: str) -> None:
    check_sensor(SENSOR, PARAMETERS)
    px, py = SENSOR.pixel_size_mm
    with pytest.raises(PixelSizeError, match=unit):
        check_sensor(Sensor((568, 416), (factor * px, factor * py)), PARAMETERS)


@pytest.mark.parametrize(
    ("scale", "words"),
    [(0.001, "normalized"), (2.0, "lies outside the image of 568 x 416 px")],
)
def test_image_points_are_pixels_of_the_image(scale: float, words: str) -> None:
    image = stereo_shot().left
    check_image_points([("left", image)], SENSOR, PARAMETERS)
    scaled = ImagePoints.build(image.ids, image.control_mm, scale * image.pixels)
    with pytest.raises(PointsError, match=words):
        check_image_points([("left", scaled)], SENSOR, PARAMETERS)


def test_exchanged_image_coordinates_are_named() -> None:
    image = stereo_shot().left
    exchanged = ImagePoints.build(image.ids, image.control_mm, image.pixels[:, ::-1])
    with pytest.raises(PointsError, match="or exchange u_px and v_px"):
        check_image_points([("left", exchanged)], SENSOR, PARAMETERS)


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


def test_the_deviation_of_the_baseline_is_that_of_rigs_drawn_from_the_covariance() -> None:
    adjustment = solved(stereo_shot(sigma_px=0.05)).adjustment
    samples = [r.baseline_mm for r in sample_rigs(adjustment, 2000, np.random.default_rng(1))]
    assert baseline_sd_mm(adjustment) == pytest.approx(np.std(samples), rel=0.1)


def test_a_sound_fit_has_no_doubts_and_limits_refuse_or_flag() -> None:
    calibration = solved(stereo_shot(sigma_px=0.05))
    fit = (calibration.rig, calibration.shots, calibration.adjustment)
    doubts = fit_doubts(*fit, PARAMETERS)
    assert not doubts.refused
    assert not doubts.flagged
    share = baseline_sd_mm(calibration.adjustment) / calibration.rig.baseline_mm
    flagged = fit_doubts(*fit, replace(PARAMETERS, baseline_sd=2 * share))
    assert not flagged.refused
    assert "baseline 42" in flagged.flagged[0]
    refused = fit_doubts(*fit, replace(PARAMETERS, baseline_sd=share / 2, residual_of_field=1e-6))
    assert len(refused.refused) == 2


def test_the_limits_of_a_fit_grow_with_baseline_and_field() -> None:
    calibration = solved(stereo_shot(sigma_px=0.05))
    limits = fit_limits(calibration.rig, calibration.shots, PARAMETERS)
    assert limits.rms_px == PARAMETERS.rms_px
    assert limits.baseline_sd_mm[1] == pytest.approx(0.05 * calibration.rig.baseline_mm)
    control = np.concatenate([image.control_mm for image in calibration.shots[0].images])
    assert limits.reconstruction_mm[1] == pytest.approx(0.01 * np.linalg.norm(np.ptp(control, axis=0)))
    for flagged, refused in (limits.baseline_sd_mm, limits.reconstruction_mm):
        assert flagged == pytest.approx(PARAMETERS.doubtful * refused)


def test_several_shots_are_refused_by_their_residuals_against_those_of_each_camera() -> None:
    late = stereo_shot("B", placement=moved_board(2))
    mixed = Shot("B", stereo_shot("B", placement=moved_board(3, 0.3, 3.0)).left, late.right)
    calibration = calibrate_stereo([stereo_shot(), mixed], SENSORS, SolveParameters(check_orientation=False))
    shots = calibration.without_blunders()
    doubts = fit_doubts(calibration.rig, shots, calibration.adjustment, PARAMETERS)
    assert any("each camera alone" in reason for reason in doubts.refused)


def test_without_redundancy_nothing_is_doubted() -> None:
    few = stereo_shot(ids=("3", "6", "10", "11", "15", "18"))
    free = ("X0", "Y0", "Z0", "omega", "phi", "kappa", "f", "x0", "y0", "K1", "K2", "P1")
    calibration = calibrate_stereo([few], SENSORS, SolveParameters(free=free))
    doubts = fit_doubts(calibration.rig, calibration.shots, calibration.adjustment, PARAMETERS)
    assert (doubts.refused, doubts.flagged) == ((), ())


def test_a_second_exposure_of_the_same_placement_is_a_repeated_shot() -> None:
    first, again = stereo_shot("A", sigma_px=0.03), stereo_shot("B", sigma_px=0.03, seed=5)
    moved = stereo_shot("C", placement=moved_board(1, 0.0, 2.0), sigma_px=0.03)
    few = stereo_shot("D", ids=TYPICAL[:4])
    repeated = repeated_shots([first, moved, again, again], PARAMETERS)
    assert {later: earlier for later, (earlier, _) in repeated.items()} == {2: 0, 3: 0}
    assert 0.02 < repeated[2][1] < 0.08
    assert not repeated_shots([stereo_shot(ids=TYPICAL[4:]), few], PARAMETERS)
