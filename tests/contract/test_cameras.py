import json

import pytest

from contract.cameras import CamerasResult
from spinewatch.calibration import from_images
from spinewatch.calibration.cameras import CalibratedCameras, calibrate_cameras
from spinewatch.calibration.points import Sensor
from spinewatch.rig_files.rig_json import camera_to_dict


@pytest.fixture(scope="module")
def cameras(calibrated: from_images.CalibrationResult) -> CalibratedCameras:
    shots = calibrated.calibration.shots
    images = {side: {shot.name: getattr(shot, side) for shot in shots} for side in ("left", "right")}
    rig = calibrated.calibration.rig
    return calibrate_cameras(images, Sensor(rig.left.image_size_px, rig.left.pixel_size_mm))


def test_cameras_pass_through_json_unchanged(cameras: CalibratedCameras) -> None:
    made = CamerasResult.of(cameras, "0")
    text = json.dumps(made.model_dump(mode="json"), allow_nan=False)
    assert CamerasResult.model_validate(json.loads(text)) == made


def test_a_named_camera_is_a_camera_of_a_rig_with_its_name_first(cameras: CalibratedCameras) -> None:
    first = CamerasResult.of(cameras, "0").model_dump(mode="json")["cameras"][0]
    assert first == {"name": "left", **camera_to_dict(cameras.cameras["left"])}
    assert next(iter(first)) == "name"


def test_every_pair_and_camera_has_its_quality(cameras: CalibratedCameras) -> None:
    made = CamerasResult.of(cameras, "0")
    assert set(made.quality) == {"left", "right"}
    (pair,) = made.pairs
    assert pair.cameras == ["left", "right"]
    assert [shot.name for shot in pair.shots] == made.shots == ["C"]
    assert made.quality["left"].image_rms_px == cameras.adjustment.camera_rms_px(0)
