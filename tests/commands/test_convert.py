from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from commands.main import cli
from spinewatch.camera import Rig
from spinewatch.rig_files.rig_json import parse_rig
from tests.paths import SAMPLES

RIG = SAMPLES / "D1/rig.json"


def convert(*arguments: object) -> Result:
    return CliRunner().invoke(cli, ["convert", *map(str, arguments)])


def pixels(rig: Rig) -> np.ndarray:
    points = np.array([434.0, 390.0, 60.0]) + np.random.default_rng(0).uniform(-60, 60, (50, 3))
    return np.stack([rig.left.project(points), rig.right.project(points)])


@pytest.mark.parametrize(
    ("rig_format", "within_px"), [("json", 0), ("1995", 1e-6), ("opencv", 0.005), ("openptv", 0.1)]
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
