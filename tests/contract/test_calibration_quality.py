import json
from dataclasses import replace

import numpy as np

from contract.calibration import CalibrationResult
from contract.calibration_quality import calibration_result
from spinewatch.calibration import from_images
from spinewatch.calibration.plausibility.limits import CalibrationLimits
from spinewatch.calibration.quality.stereo_geometry import StereoGeometry


def test_a_calibration_passes_through_json_unchanged(calibrated: from_images.CalibrationResult) -> None:
    made = calibration_result(calibrated, "0")
    text = json.dumps(made.model_dump(mode="json"), allow_nan=False)
    assert CalibrationResult.model_validate(json.loads(text)) == made


def test_every_shot_has_its_points_and_residuals(calibrated: from_images.CalibrationResult) -> None:
    made = calibration_result(calibrated, "0")
    used, held_out = made.shots
    assert (used.used, held_out.used) == (True, False)
    assert [shot.name for shot in made.shots] == ["C", "A"]
    assert all(point.residual_px is not None for point in used.points.left)
    assert all(point.residual_px is None for point in held_out.points.right)
    assert held_out.image_rms_left_px is None
    residuals = calibrated.calibration.adjustment.residuals_px[0, 0]
    adjusted = [point.residual_px for point in used.points.left if point.residual_px is not None]
    np.testing.assert_array_equal(adjusted, residuals)
    assert used.image_rms_left_px == np.sqrt(np.mean(residuals**2))


def test_cameras_are_described_by_side(calibrated: from_images.CalibrationResult) -> None:
    made = calibration_result(calibrated, "0")
    for side, camera in (("left", made.cameras.left), ("right", made.cameras.right)):
        assert camera.free == list(calibrated.calibration.free[side])
        assert set(camera.sd) == set(camera.free)
        assert camera.image_rms_px == calibrated.calibration.rms_px[side]
    assert made.rig.left.focal_length_mm == calibrated.calibration.rig.left.focal_length_mm
    for pair in made.strong_correlations:
        assert abs(pair.correlation) > 0.9
        assert all(name.split()[0] in {"left", "right"} for name in pair.between)


def test_the_limits_that_it_was_compared_with_are_given(calibrated: from_images.CalibrationResult) -> None:
    made = calibration_result(calibrated, "0")
    assert made.limits is not None
    assert made.limits.rms_px == CalibrationLimits().rms_px
    assert made.limits.baseline_sd_mm[1] == 0.05 * calibrated.calibration.rig.baseline_mm
    assert made.limits.reference_sd_mm == [0.34, 0.35, 0.66]
    for camera in (made.cameras.left, made.cameras.right):
        assert set(camera.sd_limits) == set(camera.free) - {"X0", "Y0", "Z0", "omega", "phi", "kappa"}
        for name, limit in camera.sd_limits.items():
            sd = camera.sd[name]
            assert sd is not None
            assert limit is not None
            assert sd < limit


def test_what_is_not_determined_is_null(calibrated: from_images.CalibrationResult) -> None:
    unknown: StereoGeometry = replace(
        calibrated.geometry, baseline_sd_mm=float("nan"), depth_of_field_mm=(500.0, float("inf"))
    )
    made = calibration_result(replace(calibrated, geometry=unknown, leave_one_out=None), "0")
    assert made.geometry.baseline_sd_mm is None
    assert made.geometry.depth_of_field_mm == [500.0, None]
    assert made.leave_one_out is None
