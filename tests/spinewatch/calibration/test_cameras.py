import numpy as np
import pytest

from spinewatch.calibration.cameras import calibrate_cameras
from spinewatch.calibration.control_field import pegboard_1995
from spinewatch.calibration.errors import PlanarFieldError, PointsError, TooFewPointsError
from spinewatch.calibration.points import ImagePoints, Sensor
from spinewatch.camera import Camera
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.simulation.rigs import converging_rig

FIELD = pegboard_1995()
NEAR, FAR = (converging_rig(b, v, target_mm=(317.5, 254.0, 40.0)) for b, v in ((500.0, 24.0), (300.0, 18.0)))
CAMERAS = {"a": NEAR.left, "b": NEAR.right, "c": FAR.left}
SENSOR = Sensor(NEAR.left.image_size_px, NEAR.left.pixel_size_mm)
SHIFTED = RigidTransform(np.eye(3), np.array([10.0, -15.0, 5.0]))


def image(camera: Camera, placement: RigidTransform, sigma_px: float = 0.0) -> ImagePoints:
    noise = sigma_px * np.random.default_rng(1).standard_normal((30, 2))
    return ImagePoints.build(FIELD.ids, FIELD.points_mm, camera.project(placement(FIELD.points_mm)) + noise)


def test_three_cameras_and_two_shots_are_solved_exactly_and_tied_by_the_placement() -> None:
    shots = {"1": RigidTransform.identity(), "2": SHIFTED}
    result = calibrate_cameras(
        {name: {shot: image(c, place) for shot, place in shots.items()} for name, c in CAMERAS.items()},
        SENSOR,
    )
    for name, true in CAMERAS.items():
        assert result.cameras[name].position_mm == pytest.approx(true.position_mm, abs=1e-4)
        assert set(result.sd(name)) >= {"X0", "f"}
    assert result.adjustment.block.placements[1].translation_mm == pytest.approx([10, -15, 5], abs=1e-5)
    assert set(result.pairs) == {("a", "b"), ("a", "c"), ("b", "c")}


def test_one_camera_is_enough_and_has_no_pairs() -> None:
    result = calibrate_cameras({"a": {"1": image(NEAR.left, RigidTransform.identity(), 0.05)}}, SENSOR)
    assert result.adjustment.rms_px == pytest.approx(0.05, abs=0.02)
    assert not result.pairs


def test_what_cannot_be_solved_names_the_camera() -> None:
    good = image(NEAR.left, RigidTransform.identity())
    with pytest.raises(TooFewPointsError, match="camera b has 3 points of shot 1"):
        calibrate_cameras({"a": {"1": good}, "b": {"1": good.keep(np.arange(30) < 3)}}, SENSOR)
    flat = good.keep(np.isclose(FIELD.points_mm[:, 2], 45, atol=0.4))
    with pytest.raises(PlanarFieldError, match="camera b"):
        calibrate_cameras({"a": {"1": good}, "b": {"1": flat}}, SENSOR)
    other = ImagePoints.build(FIELD.ids, FIELD.points_mm + np.eye(30, 3), good.pixels)
    with pytest.raises(PointsError, match="point 1 has other object coordinates in b than in a"):
        calibrate_cameras({"a": {"1": good}, "b": {"1": other}}, SENSOR)
