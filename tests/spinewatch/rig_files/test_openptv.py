import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.errors import RigError
from spinewatch.geometry.rotations import rotation_from_angles
from spinewatch.rig_files.openptv import format_openptv, glass_warning, parse_openptv
from spinewatch.simulation.rigs import random_rig

ORI = """78.11540017 15.92351739 -570.78991501
    -56.53585681  2.98297501  56.53131934

    -0.9872980 -0.0171298  0.1579534
    -0.0153230  0.9998026  0.0126498
    -0.1581389  0.0100688 -0.9873655

      0.0000   0.0000
     70.0000

       0.0    0.0  -125.0
"""
DEGREES = ORI.replace(
    "-56.53585681  2.98297501  56.53131934",
    " ".join(f"{math.degrees(x):.6f}" for x in (-56.53585681, 2.98297501, 56.53131934)),
)
ADDPAR = "0 0 0 0 0 1 0"
SIZE, PIXEL = (1280, 1024), (0.012, 0.012)


def test_an_ori_file_gives_the_rotation_that_it_prints() -> None:
    camera, error_px = parse_openptv(ORI, ADDPAR, SIZE, PIXEL)
    printed = np.array([float(x) for x in ORI.split()[6:15]]).reshape(3, 3)
    assert np.abs(camera.M.T - printed).max() < 1e-6
    assert np.abs(rotation_from_angles(*camera.rotation_deg) - camera.M).max() == 0
    assert error_px < 1e-9
    assert camera.position_mm == (78.11540017, 15.92351739, -570.78991501)


def test_radial_distortion_is_that_of_openptv() -> None:
    k1 = 1e-5
    camera, error_px = parse_openptv(ORI, f"{k1} 0 0 0 0 1 0", SIZE, PIXEL)
    ideal = np.array([[3.0, -2.0], [-6.0, 5.0]])
    r2 = (ideal**2).sum(axis=1, keepdims=True)
    measured = camera.distort(ideal - camera.principal_point_mm)
    assert np.abs(measured - ideal * (1 + k1 * r2)).max() / PIXEL[0] <= 1.5 * error_px + 1e-6


@given(st.integers(0, 2**32 - 1))
def test_round_trip_projects_alike_within_the_stated_errors(seed: int) -> None:
    camera = random_rig(np.random.default_rng(seed)).left
    ori, addpar, out_px = format_openptv(camera)
    back, in_px = parse_openptv(ori, addpar, camera.image_size_px, camera.pixel_size_mm)
    X = np.random.default_rng(seed).uniform((390, 360, 60), (480, 420, 120), (20, 3))
    assert np.abs(back.project(X) - camera.project(X)).max() <= 2 * (out_px + in_px) + 1e-4
    assert [math.radians(a) for a in camera.rotation_deg] == pytest.approx(
        [float(x) for x in ori.split()[3:6]], abs=1e-9
    )


@pytest.mark.parametrize(
    ("ori", "addpar", "problem"),
    [
        ("1 2 3", ADDPAR, "21"),
        (ORI, "0 0", "7"),
        (ORI.replace("70.0000", "x"), ADDPAR, "not a number"),
        (ORI.replace("70.0000", "7_0.0000"), ADDPAR, "underscore"),
        (ORI.replace("70.0000", "nan"), ADDPAR, "not finite"),
        (ORI.replace("70.0000", "nan"), ADDPAR, "finite"),
        (ORI.replace("70.0000", "-70"), ADDPAR, "positive"),
        (ORI.replace("2.98297501", "2.78297501"), ADDPAR, "contradict"),
        (ORI.replace("-0.9872980", "0.9872980"), ADDPAR, "contradict"),
        (DEGREES, ADDPAR, "in degrees"),
        (ORI, "0 0 0 0 0 0 0", "scale of 0"),
    ],
)
def test_errors_name_the_problem(ori: str, addpar: str, problem: str) -> None:
    with pytest.raises(RigError, match=problem):
        parse_openptv(ori, addpar, SIZE, PIXEL)


def test_angles_are_kept_without_whole_turns() -> None:
    camera, _ = parse_openptv(ORI, ADDPAR, SIZE, PIXEL)
    assert max(map(abs, camera.rotation_deg)) <= 360


def test_a_glass_wall_is_warned_of() -> None:
    assert "125 mm" in str(glass_warning(ORI))
    assert glass_warning(format_openptv(random_rig(np.random.default_rng(0)).left)[0]) is None
