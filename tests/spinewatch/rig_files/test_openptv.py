import numpy as np
import pytest

from spinewatch.errors import RigError
from spinewatch.geometry.rotations import rotation_from_angles
from spinewatch.rig_files.openptv import parse_openptv, write_openptv
from spinewatch.simulation.rigs import table_3_3_rig

ORI = """78.11540017 15.92351739 -570.78991501
    -56.53585681  2.98297501  56.53131934

    -0.9872980 -0.0171298  0.1579534
    -0.0153230  0.9998026  0.0126498
    -0.1581389  0.0100688 -0.9873655

      0.0000   0.0000
     70.0000

       0.0    0.0  -125.0
"""


def test_an_ori_file_gives_the_rotation_that_it_prints() -> None:
    camera, error_px = parse_openptv(ORI, "0 0 0 0 0 1 0", (1280, 1024), (0.012, 0.012))
    printed = np.array([float(x) for x in ORI.split()[6:15]]).reshape(3, 3)
    assert np.abs(camera.M.T - printed).max() < 1e-6
    assert np.abs(rotation_from_angles(*camera.rotation_deg) - camera.M).max() == 0
    assert error_px < 1e-9
    assert camera.position_mm == (78.11540017, 15.92351739, -570.78991501)


def test_there_and_back_projects_alike() -> None:
    camera = table_3_3_rig().left
    ori, addpar, error_px = write_openptv(camera)
    back, _ = parse_openptv(ori, addpar, camera.image_size_px, camera.pixel_size_mm)
    X = np.random.default_rng(0).uniform((300, 300, 0), (550, 480, 120), (20, 3))
    assert error_px < 0.1
    assert np.abs(back.project(X) - camera.project(X)).max() < 0.1


def test_short_files_are_refused() -> None:
    with pytest.raises(RigError, match="21"):
        parse_openptv("1 2 3", "0 0 0 0 0 1 0", (1280, 1024), (0.012, 0.012))
