import json
from pathlib import Path

from typer.testing import CliRunner

from commands.main import cli
from spinewatch.errors import SpinewatchError
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
    assert "built in: pegboard-1995" in str(ran.exception)
