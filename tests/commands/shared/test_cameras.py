import shutil
from pathlib import Path

import pytest

from commands.shared.cameras import calibrate_camera_points
from spinewatch.calibration.solve.parameters import SolveParameters
from spinewatch.errors import ParameterError
from tests.paths import SAMPLES

CAVITY = SAMPLES / "calibration" / "openptv"


def test_one_camera_is_named_after_its_file() -> None:
    document = calibrate_camera_points([CAVITY / "cam3.csv"], SolveParameters(), "1280x1024", "0.012,0.012")
    assert [camera["name"] for camera in document["cameras"]] == ["cam3"]
    assert document["pairs"] == []


def test_two_files_of_one_name_are_an_error(tmp_path: Path) -> None:
    shutil.copy(CAVITY / "cam3.csv", tmp_path)
    with pytest.raises(ParameterError, match="two files have the same name"):
        calibrate_camera_points(
            [CAVITY / "cam3.csv", tmp_path / "cam3.csv"], SolveParameters(), "1280x1024", None
        )
