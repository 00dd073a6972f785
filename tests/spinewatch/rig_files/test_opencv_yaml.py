import cv2
import numpy as np
import pytest

from spinewatch.camera import Rig
from spinewatch.errors import RigError
from spinewatch.rig_files.opencv_camera import to_opencv
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


SOUND = format_opencv(large_rig())[0]


@pytest.mark.parametrize(
    ("old", "new", "field", "problem"),
    [
        ("dt: d", "", "left.camera_matrix", "has no dt"),
        ("!!opencv-matrix", "", None, ""),
        ("0., 0., 1. ]", "0., 0. ]", "left.camera_matrix", "8 entries for 3 x 3"),
        ("image_width: 568", "image_width: 568.5", "left.image_width, image_height", "whole"),
        (
            "image_width: 568",
            "distortion_model: fisheye\n   image_width: 568",
            "left.distortion_model",
            "fisheye",
        ),
        (
            "image_width: 568",
            "distortion_model: equidistant\n   image_width: 568",
            "left.distortion_model",
            "equi",
        ),
        ("image_width: 568", "distortion_model: plumb_bob\n   image_width: 568", None, ""),
        ("left:", "fisheye_model: 1\nleft:", "fisheye_model", "fisheye"),
        ("left:", "fisheye_model: 0\nleft:", None, ""),
    ],
)
def test_what_is_not_a_standard_camera_is_named(old: str, new: str, field: str | None, problem: str) -> None:
    text = SOUND.replace(old, new, 1)
    assert text != SOUND
    if field is None:
        parse_opencv(text, "rig")
        return
    with pytest.raises(RigError, match=problem) as caught:
        parse_opencv(text, "rig")
    assert caught.value.field == field


def test_matrices_as_ros_writes_them_are_named() -> None:
    """ROS writes neither the first line of OpenCV's files nor the type of a matrix."""
    text = SOUND.partition("---\n")[2]
    assert parse_opencv(text, "rig")[0].baseline_mm == pytest.approx(420)
    with pytest.raises(RigError, match="as ROS writes matrices"):
        parse_opencv(text.replace("!!opencv-matrix", "").replace("      dt: d\n", ""), "rig")


def test_errors_of_the_camera_name_the_matrix_of_the_file() -> None:
    with pytest.raises(RigError, match="another image size") as caught:
        parse_opencv(SOUND.replace("image_width: 568", "image_width: 284", 1), "rig")
    assert caught.value.field == "left.camera_matrix"


def stereo_texts(rig: Rig) -> tuple[str, str]:
    """What OpenCV's stereo_calib.cpp writes for a rig."""
    left, right = to_opencv(rig.left), to_opencv(rig.right)
    R = right.R @ left.R.T
    texts = []
    for entries in (
        {"M1": left.K, "D1": left.dist, "M2": right.K, "D2": right.dist},
        {"R": R, "T": right.t - R @ left.t},
    ):
        file = cv2.FileStorage("x.yml", cv2.FILE_STORAGE_WRITE | cv2.FILE_STORAGE_MEMORY)
        for key, value in entries.items():
            file.write(key, value.reshape(len(value), -1))
        texts.append(file.releaseAndGetString())
    return texts[0], texts[1]


def test_intrinsics_and_extrinsics_give_the_rig_in_the_frame_of_the_left_camera() -> None:
    rig = large_rig()
    intrinsics, extrinsics = stereo_texts(rig)
    back, error_px = parse_opencv(intrinsics, "pair", extrinsics=extrinsics, image_size_px=(568, 416))
    assert error_px < 0.01
    assert list(back.left.position_mm) == [0, 0, 0]
    assert np.abs(back.left.M - np.eye(3)).max() < 1e-12
    assert back.baseline_mm == pytest.approx(rig.baseline_mm)
    assert back.vergence_deg == pytest.approx(rig.vergence_deg)
    X = np.random.default_rng(0).uniform((390, 360, 60), (480, 420, 120), (30, 3))
    moved = (X - rig.left.centre) @ rig.left.M.T
    for camera, again in ((rig.left, back.left), (rig.right, back.right)):
        assert np.abs(again.project(moved) - camera.project(X)).max() < 0.01


def test_both_parts_may_be_in_one_file() -> None:
    intrinsics, extrinsics = stereo_texts(large_rig())
    one = intrinsics + extrinsics.partition("---\n")[2]
    back, _ = parse_opencv(one, "pair", image_size_px=(568, 416))
    assert back.baseline_mm == pytest.approx(420)


def test_what_intrinsics_lack_is_named() -> None:
    intrinsics, extrinsics = stereo_texts(large_rig())
    with pytest.raises(RigError, match="--image-size"):
        parse_opencv(intrinsics, "pair", extrinsics=extrinsics)
    with pytest.raises(RigError, match=r"extrinsics\.yml"):
        parse_opencv(intrinsics, "pair", image_size_px=(568, 416))
    with pytest.raises(RigError, match="'T' has 2 numbers"):
        parse_opencv(
            intrinsics,
            "pair",
            extrinsics=_short_translation(extrinsics),
            image_size_px=(568, 416),
        )


def _short_translation(extrinsics: str) -> str:
    head, _, rest = extrinsics.partition("T: ")
    data = rest.partition("[")[2].partition("]")[0].split(",")[:2]
    return f"{head}T: !!opencv-matrix\n   rows: 2\n   cols: 1\n   dt: d\n   data: [ {', '.join(data)} ]\n"
