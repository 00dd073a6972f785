import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from commands.main import cli
from spinewatch.rig_files.rig_json import parse_rig
from tests.paths import SAMPLES

RIG = SAMPLES / "D1" / "rig.json"


def run(*arguments: object) -> str:
    result = CliRunner().invoke(cli, [str(a) for a in arguments])
    assert result.exit_code == 0, result.output
    return result.output


def test_simulate_writes_truth_features_and_the_rig_to_measure_with(tmp_path: Path) -> None:
    run("simulate", tmp_path, "--rig", RIG, "--scenes", 2, "--hidden", 1, "--calibration-error", 0.05, 0.1)
    for name in ("s0000", "s0001"):
        truth, features = (
            json.loads((tmp_path / name / f"{f}.json").read_text()) for f in ("truth", "features")
        )
        assert len(truth["triads"]) == 4
        assert len(features["left"]) + len(features["right"]) == 2 * (12 + 10) - 1
        assert set(features["left"][0]) == {"x", "y", "score", "sd_px", "visible_fraction"}
        assert parse_rig((tmp_path / name / "rig.json").read_bytes()).name.endswith("(perturbed)")


def test_plan_predicts_each_level_and_the_cobb_angle() -> None:
    output = run("plan", "--rig", RIG, "--levels", "L1,T10,T8", "--triad-size", 1.5)
    assert all(level in output for level in ("L1", "T10", "T8"))
    assert "Cobb angle L1 to T8:" in output
    assert "distances 34.2, 42.0, 25.8 mm" in output


@pytest.mark.parametrize("radius", [18])
def test_plan_finds_a_better_marker(radius: int) -> None:
    assert f"Marker disc-{radius}" in run("plan", "--rig", RIG, "--levels", "L1,T9", "--disc", radius)
