from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner, Result

from commands.main import cli
from spinewatch.camera import Rig
from spinewatch.errors import RigError
from spinewatch.rig_files.opencv_camera import to_opencv
from spinewatch.rig_files.rig_json import parse_rig
from tests.paths import SAMPLES

RIG = SAMPLES / "D1/rig.json"


def convert(*arguments: object) -> Result:
    return CliRunner().invoke(cli, ["convert", *map(str, arguments)])


def pixels(rig: Rig) -> np.ndarray:
    points = np.array([434.0, 390.0, 60.0]) + np.random.default_rng(0).uniform(-60, 60, (50, 3))
    return np.stack([rig.left.project(points), rig.right.project(points)])


@pytest.mark.parametrize(
    ("rig_format", "within_px"), [("json", 0), ("1995", 1e-3), ("opencv", 0.005), ("openptv", 0.1)]
)
def test_round_trip_projects_alike(rig_format: str, within_px: float, tmp_path: Path) -> None:
    there, back = tmp_path / "there", tmp_path / "back.json"
    if rig_format == "openptv":
        there.mkdir()
    for ran in (
        convert(RIG, "--to", rig_format, "--out", there),
        convert(there, "--from", rig_format, "--out", back, "--name", "again"),
    ):
        assert ran.exit_code == 0, ran.exception
    rig, original = (parse_rig(path.read_text()) for path in (back, RIG))
    assert rig.name == (original.name if rig_format == "json" else "again")
    assert np.abs(pixels(rig) - pixels(original)).max() <= within_px


def test_the_error_of_the_fitted_distortion_is_printed(tmp_path: Path) -> None:
    ran = convert(RIG, "--to", "opencv", "--out", tmp_path / "rig.yml")
    error = float(ran.output.split()[-2])
    assert 0 < error < 0.005


def test_errors_name_the_file_or_field(tmp_path: Path) -> None:
    broken = tmp_path / "broken.yml"
    broken.write_text("%YAML:1.0\n---\nleft: 1\n")
    ran = convert(broken, "--from", "opencv", "--out", tmp_path / "out.json")
    assert "left" in str(ran.exception)
    assert "cannot write" in str(convert(RIG, "--to", "openptv", "--out", tmp_path / "none").exception)
    assert "cannot read" in str(convert(tmp_path / "none", "--out", tmp_path / "out.json").exception)


def test_intrinsics_are_read_with_the_extrinsics_beside_them(tmp_path: Path) -> None:
    rig = parse_rig(RIG.read_bytes())
    left, right = to_opencv(rig.left), to_opencv(rig.right)
    R = right.R @ left.R.T
    for name, entries in (
        ("intrinsics.yml", {"M1": left.K, "D1": left.dist, "M2": right.K, "D2": right.dist}),
        ("extrinsics.yml", {"R": R, "T": right.t - R @ left.t}),
    ):
        file = cv2.FileStorage(str(tmp_path / name), cv2.FILE_STORAGE_WRITE)
        for key, value in entries.items():
            file.write(key, value.reshape(len(value), -1))
        file.release()
    source, out = tmp_path / "intrinsics.yml", tmp_path / "rig.json"
    ran = convert(source, "--from", "opencv", "--image-size", "568x416", "--out", out)
    assert ran.exit_code == 0, ran.exception
    assert parse_rig(out.read_bytes()).baseline_mm == pytest.approx(rig.baseline_mm)
    assert "--image-size" in str(convert(source, "--from", "opencv", "--out", out).exception)
    (tmp_path / "extrinsics.yml").unlink()
    ran = convert(source, "--from", "opencv", "--image-size", "568x416", "--out", out)
    assert "extrinsics.yml" in str(ran.exception)


def test_warnings_of_the_file_are_printed(tmp_path: Path) -> None:
    assert convert(RIG, "--to", "openptv", "--out", tmp_path).exit_code == 0
    ori = tmp_path / "left.ori"
    ori.write_text("\n".join([*ori.read_text().splitlines()[:-1], "0 0 120"]))
    ran = convert(tmp_path, "--from", "openptv", "--out", tmp_path / "rig.json")
    assert ran.exit_code == 0
    assert "warning: left.ori: the glass wall" in ran.stderr


def test_an_implausible_rig_is_not_written(tmp_path: Path) -> None:
    source, out = tmp_path / "rig.json", tmp_path / "out.json"
    source.write_text(RIG.read_text().replace("0.00845", "8.45").replace("0.01", "10.0"))
    assert isinstance(convert(source, "--out", out).exception, RigError)
    assert not out.exists()
