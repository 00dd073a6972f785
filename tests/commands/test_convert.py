import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from commands.main import cli
from spinewatch.camera import Rig
from spinewatch.rig_files.rig_json import parse_rig
from tests.paths import SAMPLES

RIG = SAMPLES / "D1/rig.json"


def convert(*arguments: str) -> None:
    ran = CliRunner().invoke(cli, ["convert", *arguments])
    assert ran.exit_code == 0, ran.exception


def pixels(rig: Rig) -> np.ndarray:
    points = np.array([434.0, 390.0, 60.0]) + np.random.default_rng(0).uniform(-60, 60, (50, 3))
    return np.stack([rig.left.project(points), rig.right.project(points)])


@pytest.mark.parametrize(("form", "within_px"), [("1995", 1e-6), ("opencv", 0.005), ("openptv", 0.1)])
def test_a_rig_survives_the_way_out_and_back(form: str, within_px: float, tmp_path: Path) -> None:
    there, back = tmp_path / "there", tmp_path / "back.json"
    if form == "openptv":
        there.mkdir()
    convert(str(RIG), "--to", form, "--out", str(there))
    convert(str(there), "--from", form, "--out", str(back), "--name", "again")
    rig = parse_rig(back.read_text())
    assert rig.name == "again"
    assert np.abs(pixels(rig) - pixels(parse_rig(RIG.read_text()))).max() < within_px


def test_what_cannot_be_read_is_named(tmp_path: Path) -> None:
    out = ["--out", str(tmp_path / "out.json")]
    broken = tmp_path / "broken.yml"
    for text, field in (
        ("no yaml", "FileStorage"),
        ("%YAML:1.0\n---\nleft: 1\n", "left"),
        (
            "%YAML:1.0\n---\nleft:\n   image_width: 5\n   image_height: 4\n   camera_matrix: 3\n",
            "camera_matrix",
        ),
    ):
        broken.write_text(text)
        ran = CliRunner().invoke(cli, ["convert", str(broken), "--from", "opencv", *out])
        assert field in str(ran.exception)
    ran = CliRunner().invoke(cli, ["convert", str(RIG), "--to", "openptv", "--out", str(tmp_path / "none")])
    assert "cannot write" in str(ran.exception)
    assert json.loads(RIG.read_text())["left"]
