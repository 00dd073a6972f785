import cv2
import numpy as np
import pytest

from spinewatch.errors import RigError
from spinewatch.rig_files.opencv_yaml import format_opencv, parse_opencv
from spinewatch.simulation.rigs import large_rig

START = "%YAML:1.0\n---\n"


def test_round_trip_projects_alike_within_the_stated_errors() -> None:
    rig = large_rig()
    text, out_px = format_opencv(rig)
    back, in_px = parse_opencv(text, "again")
    assert back.name == "again"
    X = np.random.default_rng(0).uniform((390, 360, 60), (480, 420, 120), (30, 3))
    for camera, again in ((rig.left, back.left), (rig.right, back.right)):
        assert np.abs(again.project(X) - camera.project(X)).max() <= 1.5 * (out_px + in_px)


def test_opencv_reads_the_matrices() -> None:
    text, _ = format_opencv(large_rig())
    file = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
    R = file.getNode("right").getNode("rotation_matrix").mat()
    assert np.abs(R @ R.T - np.eye(3)).max() < 1e-12
    assert file.getNode("left").getNode("image_width").real() == 568


@pytest.mark.parametrize(
    ("text", "field"),
    [
        ("no yaml", "(document)"),
        (START + "left: 1\n", "left"),
        (START + "left:\n   image_width: 0\n   image_height: 4\n", "left.image_width, image_height"),
        (START + "left:\n   image_width: 5\n   image_height: 4\n   camera_matrix: 3\n", "left.camera_matrix"),
        (format_opencv(large_rig())[0].replace("right:", "middle:"), "right"),
    ],
)
def test_errors_name_the_field(text: str, field: str) -> None:
    with pytest.raises(RigError) as caught:
        parse_opencv(text, "rig")
    assert caught.value.field == field
