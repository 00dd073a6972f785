"""The programs of 1995, one after the other, as a reader of the thesis would run them."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from commands.main import cli
from spinewatch.calibration.control_field import pegboard_1995
from spinewatch.errors import SpinewatchError
from spinewatch.imaging.decoding import decode_image
from spinewatch.simulation.rigs import table_3_3_rig
from spinewatch.thesis_1995.data_files import (
    FeatureList,
    format_features,
    parse_features,
    parse_match_coordinates,
    parse_residuals,
    parse_triads,
    parse_world_points,
)
from tests.paths import SAMPLES

D1 = SAMPLES / "D1"


def run(*arguments: object) -> Result:
    return CliRunner().invoke(cli, [str(argument) for argument in arguments])


def printed(*arguments: object) -> str:
    done = run(*arguments)
    assert done.exit_code == 0, (done.output, done.exception)
    return done.output


@pytest.fixture(scope="module")
def points(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Image points of the peg board in both cameras, with 0.1 px of noise."""
    folder, field, rng = tmp_path_factory.mktemp("points"), pegboard_1995(), np.random.default_rng(1)
    files = []
    for side, camera in (("left", table_3_3_rig().left), ("right", table_3_3_rig().right)):
        pixels = camera.project(field.points_mm) + rng.normal(0, 0.1, (len(field.ids), 2))
        lines = ["id,x_mm,y_mm,z_mm,u_px,v_px"]
        for id_, (x, y, z), (u, v) in zip(field.ids, field.points_mm, pixels, strict=True):
            if 0 <= u < 567 and 0 <= v < 415:
                lines.append(f"{id_},{x},{y},{z},{u},{v}")
        path = folder / f"{side}.csv"
        path.write_text("\n".join(lines) + "\n")
        files.append(path)
    return files[0], files[1]


def test_pix2mm_has_its_origin_at_the_centre_and_y_upwards(tmp_path: Path) -> None:
    path = tmp_path / "FEATURES.DAT"
    path.write_text(format_features(FeatureList(np.array([[283.5, 207.5], [383.5, 107.5]]), np.ones(2))))
    assert printed("pix2mm", path).splitlines()[1:] == ["1 0.000000 0.000000", "2 1.000000 0.845000"]


def test_ndlt_prints_the_constants_and_a_camera_near_the_true_one(points: tuple[Path, Path]) -> None:
    output = printed("ndlt", points[0])
    assert "L11" in output
    position = next(line for line in output.splitlines() if line.startswith("position")).split()[1:4]
    assert np.array(position, float) == pytest.approx(table_3_3_rig().left.position_mm, abs=15)


def test_v2stereo_and_sim3d_calibrate_and_reconstruct(points: tuple[Path, Path], tmp_path: Path) -> None:
    cameras = tmp_path / "CameraParameters.dat"
    assert "px RMS" in printed("v2stereo", *points, "--out", cameras)
    accuracy = printed("sim3d", cameras, *points).splitlines()
    deviations = np.array(accuracy[-1].split()[1:], float)
    assert np.all(deviations < [0.5, 0.5, 1.0])


def test_detect_writes_features_and_the_images_of_each_step(tmp_path: Path) -> None:
    out, folder = tmp_path / "FEATURES.DAT", tmp_path / "steps"
    image = D1 / "POST" / "left.png"
    assert "features in rows" in printed("detect", image, "--out", out, "--features", 24, "--explain", folder)
    assert len(parse_features(out.read_text()).xy_px) > 10
    assert sorted(path.name for path in folder.iterdir()) == [
        "crossEd.ras",
        "crossGl.ras",
        "edge.ras",
        "final.ras",
        "pre.ras",
    ]
    for path in folder.iterdir():
        assert decode_image(path.read_bytes()).shape[1] == 568


def test_match_finds_the_triads_of_simulated_features_and_spaco_reconstructs_its_pairs(
    tmp_path: Path,
) -> None:
    scenes = tmp_path / "scenes"
    printed("simulate", scenes, "--rig", D1 / "rig.json", "--noise", 0.1, "--false-features", 3, "--seed", 4)
    scene, out = scenes / "s0000", tmp_path / "out"
    output = printed(
        "match",
        scene / "features.json",
        "--cameras",
        scene / "rig.json",
        "--labels",
        "L1,T11,T9,T7",
        "--out",
        out,
    )
    assert "heuristic" in output
    truth = json.loads((scene / "truth.json").read_text())
    triads = parse_triads((out / "SpineStage.dat").read_text())
    assert [triad.label for triad in triads] == ["L1", "T11", "T9", "T7"]
    for triad, true in zip(triads, truth["triads"], strict=True):
        assert triad.position_mm == pytest.approx(true["P_mm"], abs=1.0)
    world = parse_world_points((out / "WorldPoints.dat").read_text())
    assert len(world) == len(parse_residuals((out / "SpacoOUT.dat").read_text()))
    assert len(world) == len(parse_match_coordinates((out / "MatchCoords.dat").read_text()).left)
    lines = printed("spaco", out / "MatchCoords.dat", "--cameras", scene / "rig.json").splitlines()[1:]
    again = np.array([line.split()[1:4] for line in lines], float)
    assert again == pytest.approx(world, abs=0.01)


def test_match_reads_the_lists_that_it_wrote_and_refines_with_images(tmp_path: Path) -> None:
    lists = []
    for side in ("left", "right"):
        lists.append(tmp_path / f"Pixels{side.upper()}.dat")
        printed(
            "detect",
            D1 / "PRE" / f"{side}.png",
            "--out",
            lists[-1],
            "--features",
            24,
            "--size-reduction",
            "none",
        )
    images = [D1 / "PRE" / f"{side}.png" for side in ("left", "right")]
    output = printed(
        "match",
        *lists,
        "--cameras",
        D1 / "rig.json",
        "--labels",
        "L1,T11,T9,T7",
        "--out",
        tmp_path,
        "--images",
        *images,
    )
    words = output.split()
    candidates, refined = int(words[0]), int(words[2])
    assert refined < candidates


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (("pix2mm", "{missing}"), "cannot read"),
        (("match", "{text}", "--cameras", "{rig}", "--labels", "T9", "--out", "{folder}"), "features.json"),
        (
            (
                "match",
                "{text}",
                "{text}",
                "{text}",
                "--cameras",
                "{rig}",
                "--labels",
                "T9",
                "--out",
                "{folder}",
            ),
            "3 feature",
        ),
        (("spaco", "{text}", "--cameras", "{rig}"), "entries"),
        (("spaco", "{text}", "--cameras", "{text}"), "entries"),
        (("detect", "{text}", "--out", "{folder}/x"), "image"),
        (("ndlt", "{text}"), "text"),
    ],
)
def test_what_cannot_be_read_is_named(arguments: tuple[str, ...], problem: str, tmp_path: Path) -> None:
    text = tmp_path / "text"
    text.write_text("1 2\n")
    names = {"missing": tmp_path / "missing", "text": text, "rig": D1 / "rig.json", "folder": tmp_path}
    done = run(*(argument.format(**names) for argument in arguments))
    assert done.exit_code != 0
    assert isinstance(done.exception, SpinewatchError)
    assert problem in str(done.exception)
