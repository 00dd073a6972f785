import json
import os
import shutil
from pathlib import Path

import pytest
from PIL import Image
from typer.testing import CliRunner

from commands.main import cli
from spinewatch.calibration.errors import ShotsDisagreeError
from spinewatch.errors import ImageError, SameImageError, SpinewatchError
from spinewatch.rig_files.rig_json import parse_rig
from tests.paths import SAMPLES

C1 = SAMPLES / "calibration/C1"


def images(*trials: str) -> list[str]:
    return [str(C1 / t / f"{side}.png") for t in trials for side in ("left", "right")]


def test_images_become_a_rig_file_and_a_report(tmp_path: Path) -> None:
    rig, report = tmp_path / "rig.json", tmp_path / "report.html"
    ran = CliRunner().invoke(
        cli,
        [
            *("calibrate", *images("C", "A"), "--control-field", "pegboard-1995", "--verify", "1"),
            *("--out", str(rig), "--report", str(report), "--name", "cart 1"),
        ],
    )
    assert ran.exit_code == 0, ran.output
    document = json.loads(ran.stdout)
    assert parse_rig(rig.read_text()).name == "cart 1"
    assert [s["used"] for s in document["shots"]] == [True, False]
    assert len(document["images"]) == 4
    html = report.read_text()
    assert "http" not in html
    assert "<script" not in html
    assert "Strong correlations" in html
    assert "depth of field" in html
    assert "&amp;" not in html


def test_names_that_are_not_utf_8_are_escaped_in_the_document_and_the_report(tmp_path: Path) -> None:
    odd = Path(os.fsdecode(os.fsencode(tmp_path) + b"/shot-\xff"))
    shutil.copytree(C1 / "C", odd)
    files = [str(odd / "left.png"), str(odd / "right.png"), *images("A")]
    report = odd / "report.html"
    ran = CliRunner().invoke(
        cli, ["calibrate", *files, "--control-field", "pegboard-1995", "--report", str(report)]
    )
    assert ran.exit_code == 0, ran.output
    assert [shot["name"] for shot in json.loads(ran.stdout)["shots"]] == ["shot-\\xff", "A"]
    assert "shot-\\xff" in report.read_text()


def test_the_document_is_printed_although_the_rig_cannot_be_written(tmp_path: Path) -> None:
    out = tmp_path / "missing" / "rig.json"
    ran = CliRunner().invoke(
        cli, ["calibrate", *images("C"), "--control-field", "pegboard-1995", "--out", str(out)]
    )
    assert "cannot write" in str(ran.exception)
    assert json.loads(ran.stdout)["rig"]["name"] == "rig"


def test_a_field_that_is_not_there_is_named(tmp_path: Path) -> None:
    ran = CliRunner().invoke(cli, ["calibrate", *images("C"), "--control-field", str(tmp_path / "no.csv")])
    assert isinstance(ran.exception, SpinewatchError)
    assert "choose from pegboard-1995" in str(ran.exception)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (["--free", "f,zoom"], "zoom"),
        (["--fix", "x0=much"], "NAME=NUMBER"),
        (["--fix", "y9=0"], "y9"),
        (["--pixel-size", "0.01"], "--pixel-size"),
        (["--verify", "1"], "--verify"),
    ],
)
def test_an_option_that_means_nothing_is_named(options: list[str], word: str) -> None:
    ran = CliRunner().invoke(cli, ["calibrate", *images("C"), "--control-field", "pegboard-1995", *options])
    assert isinstance(ran.exception, SpinewatchError)
    assert word in str(ran.exception)


def test_a_shot_cannot_verify_itself() -> None:
    ran = CliRunner().invoke(
        cli, ["calibrate", *images("C", "C"), "--control-field", "pegboard-1995", "--verify", "1"]
    )
    assert isinstance(ran.exception, SameImageError)


def test_a_copy_of_a_shot_in_another_format_counts_once(tmp_path: Path) -> None:
    copies = []
    for file in images("C"):
        copies.append(str(tmp_path / Path(file).with_suffix(".tif").name))
        Image.open(file).save(copies[-1])
    ran = CliRunner().invoke(
        cli, ["calibrate", *images("C"), *copies, "--control-field", "pegboard-1995", "--verify", "1"]
    )
    assert ran.exit_code == 0, ran.output
    document = json.loads(ran.stdout)
    assert [flag["code"] for flag in document["flags"]] == ["shot-repeated"]
    assert [shot["used"] for shot in document["shots"]] == [True]


def test_images_in_the_order_left_left_right_right_are_refused() -> None:
    (c_left, c_right), (a_left, a_right) = images("C"), images("A")
    ran = CliRunner().invoke(
        cli, ["calibrate", c_left, a_left, c_right, a_right, "--control-field", "pegboard-1995"]
    )
    assert isinstance(ran.exception, ShotsDisagreeError)
    assert "give left, right, left, right" in str(ran.exception)


def test_a_file_that_is_not_an_image_is_named(tmp_path: Path) -> None:
    left, right = images("C")
    broken = tmp_path / "left.png"
    broken.write_bytes(Path(left).read_bytes()[:20_000])
    ran = CliRunner().invoke(cli, ["calibrate", str(broken), right, "--control-field", "pegboard-1995"])
    assert isinstance(ran.exception, ImageError)
    assert "left image of shot" in str(ran.exception)


def test_any_number_of_cameras_from_coordinates(tmp_path: Path) -> None:
    out, report = tmp_path / "cameras.json", tmp_path / "report.html"
    files = [str(C1.parent / f"openptv/cam{k}.csv") for k in (3, 4, 1)]
    sensor = ["--image-size", "1280x1024", "--pixel-size", "0.012,0.012"]
    written = ["--out", str(out), "--report", str(report)]
    for given in (files, files[:1]):
        ran = CliRunner().invoke(cli, ["calibrate", *given, *sensor, *written])
        assert ran.exit_code == 0, ran.output
        document = json.loads(ran.stdout)
        cameras = json.loads(out.read_text())["cameras"]
        assert [c["name"] for c in cameras] == [Path(f).stem for f in given]
        assert len(document["pairs"]) == len(given) * (len(given) - 1) / 2
        assert "cam3" in report.read_text()
    ran = CliRunner().invoke(cli, ["calibrate", *files, *sensor, "--verify", "1"])
    assert "--verify needs a stereo pair" in str(ran.exception)
