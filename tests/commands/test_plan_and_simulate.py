import json
from inspect import signature
from pathlib import Path

import pytest
from typer.testing import CliRunner

from commands.main import cli
from commands.plan import plan
from contract.features import Feature
from spinewatch.calibration.point_tables import parse_control_field
from spinewatch.planning.plan import PlanParameters
from spinewatch.rig_files.rig_json import parse_rig
from spinewatch.triads.pose_fit import PoseParameters
from tests.paths import SAMPLES

RIG = SAMPLES / "D1" / "rig.json"


def run(*arguments: object) -> str:
    result = CliRunner().invoke(cli, [str(a) for a in arguments])
    assert result.exit_code == 0, result.output or result.exception
    return result.output


def test_the_plan_assumes_the_shared_error_of_measured_poses() -> None:
    default = signature(plan).parameters["common"].default
    assert default == PlanParameters().common_sd_mrad == PoseParameters().common_sd_mrad


def test_simulate_writes_truth_features_and_the_rig_to_measure_with(tmp_path: Path) -> None:
    run("simulate", tmp_path, "--rig", RIG, "--scenes", 2, "--hidden", 1, "--calibration-error", 0.05, 0.1)
    for name in ("s0000", "s0001"):
        truth, features = (
            json.loads((tmp_path / name / f"{f}.json").read_text()) for f in ("truth", "features")
        )
        assert len(truth["triads"]) == 4
        assert len(features["left"]) + len(features["right"]) == 2 * (12 + 10) - 1
        assert set(features["left"][0]) == set(Feature.model_fields)
        assert parse_rig((tmp_path / name / "rig.json").read_bytes()).name.endswith("(perturbed)")


def test_simulate_repeats_the_scenes_of_a_seed(tmp_path: Path) -> None:
    first, again, other = (
        run("simulate", tmp_path / folder, "--rig", RIG, "--seed", seed)
        and (tmp_path / folder / "s0000" / "features.json").read_text()
        for folder, seed in (("first", 3), ("again", 3), ("other", 4))
    )
    assert first == again != other


def test_plan_accuracy_predicts_each_vertebra_and_the_cobb_angle() -> None:
    output = run("plan", "--rig", RIG, "--levels", "L1,T10,T8", "--triad-size", 1.5)
    assert all(level in output for level in ("L1", "T10", "T8"))
    assert "Cobb angle L1 to T8:" in output
    assert "distances 34.2, 42.0, 25.8 mm" in output


@pytest.mark.parametrize("radius", [18])
def test_plan_accuracy_designs_a_marker(radius: int) -> None:
    output = run("plan", "--rig", RIG, "--levels", "L1,T9", "--disc", radius)
    assert f"Marker disc-{radius}" in output


def test_a_control_field_is_designed_written_and_tried(tmp_path: Path) -> None:
    file = tmp_path / "field.csv"
    assert "20 points" in run("field", "design", file, "--rows", 4, "--columns", 5, "--spacing", 60)
    field = parse_control_field(file.read_text(), "field")
    assert {15 * round(z / 15) for z in field.points_mm[:, 2]} == set(field.points_mm[:, 2])
    output = run("field", "try", file, "--rig", RIG, "--centre", "--trials", 1)
    assert "1 of 1 calibrations converged" in output
    assert "shot used for verification" in output


def test_failed_calibrations_of_a_control_field_are_reported(tmp_path: Path) -> None:
    file = tmp_path / "field.csv"
    file.write_text("id,x_mm,y_mm,z_mm\n1,434,390,0\n2,450,390,0\n3,434,400,0\n")
    output = run("field", "try", file, "--rig", RIG, "--trials", 2)
    assert "0 of 2 calibrations converged" in output
    assert "2 failed: " in output


def test_plan_disparity_prints_each_plane_and_the_bounds() -> None:
    output = run("disparity", "--rig", RIG, "--heights", 60, 120, "--planes", 3)
    assert all(f"{z}.0" in output for z in (60, 90, 120))
    assert "Disparity u " in output
