import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from commands.main import cli
from spinewatch.errors import ImageError, SameImageError, SpinewatchError
from spinewatch.formats.rig_json import parse_rig

C1 = Path(__file__).parents[2] / "samples/calibration/C1"


def pictures(*trials: str) -> list[str]:
    return [str(C1 / t / f"{side}.png") for t in trials for side in ("left", "right")]


def test_pictures_become_a_rig_file_and_a_report(tmp_path: Path) -> None:
    rig, report = tmp_path / "rig.json", tmp_path / "report.html"
    ran = CliRunner().invoke(
        cli,
        [
            *("calibrate", *pictures("C", "A"), "--control-field", "pegboard-1995", "--verify", "1"),
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


def test_a_field_that_is_not_there_is_named(tmp_path: Path) -> None:
    ran = CliRunner().invoke(cli, ["calibrate", *pictures("C"), "--control-field", str(tmp_path / "no.csv")])
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
    ran = CliRunner().invoke(cli, ["calibrate", *pictures("C"), "--control-field", "pegboard-1995", *options])
    assert isinstance(ran.exception, SpinewatchError)
    assert word in str(ran.exception)


def test_a_shot_cannot_verify_itself() -> None:
    ran = CliRunner().invoke(
        cli, ["calibrate", *pictures("C", "C"), "--control-field", "pegboard-1995", "--verify", "1"]
    )
    assert isinstance(ran.exception, SameImageError)


def test_a_file_that_is_no_picture_is_named(tmp_path: Path) -> None:
    left, right = pictures("C")
    broken = tmp_path / "left.png"
    broken.write_bytes(Path(left).read_bytes()[:20_000])
    ran = CliRunner().invoke(cli, ["calibrate", str(broken), right, "--control-field", "pegboard-1995"])
    assert isinstance(ran.exception, ImageError)
    assert "left picture of shot" in str(ran.exception)
