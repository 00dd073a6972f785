"""``spinewatch templates build``: the set that ships, and what is printed about it."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from commands.main import cli
from spinewatch.detection.candidates.property_spaces import PropertySpace
from spinewatch.detection.candidates.templates import default_template_set, read_template_set
from spinewatch.imaging.frame import SIDES
from spinewatch.thesis_1995.template_trees import default_trees, read_trees
from tests.paths import SAMPLES

D1 = SAMPLES / "D1"


def build(out: Path, *options: str) -> str:
    folders = [str(D1 / stage) for stage in ("PRE", "INTER", "POST")]
    rig = str(D1 / "rig.json")
    arguments = ["templates", "build", *folders, "--rig", rig, "--out", str(out), "--version", "v", *options]
    done = CliRunner().invoke(cli, arguments)
    assert done.exit_code == 0, done.output
    return done.output


def test_the_command_makes_the_set_that_ships(tmp_path: Path) -> None:
    out = tmp_path / "templates.npz"
    build(out)
    made, ships = read_template_set(out.read_bytes()), default_template_set()
    assert made.trees.keys() == ships.trees.keys()
    for key, tree in ships.trees.items():
        assert made.trees[key].roots == pytest.approx(tree.roots, abs=1e-4)
        assert made.trees[key].representatives == pytest.approx(tree.representatives, abs=1e-4)


def test_the_command_reports_classes_and_proximities_and_can_fix_the_number(tmp_path: Path) -> None:
    out = tmp_path / "templates.npz"
    printed = build(out, "--gray-classes", "6", "--edge-classes", "4")
    trees = read_template_set(out.read_bytes()).trees
    for side in SIDES:
        assert len(trees[side, PropertySpace.GRAY].representatives) == 6
        assert len(trees[side, PropertySpace.EDGE].representatives) == 4
        assert f"Proximity of {side} gray templates" in printed
    assert "silhouette" in printed


def test_the_command_makes_the_trees_of_1995_that_ship(tmp_path: Path) -> None:
    out = tmp_path / "templates.npz"
    arguments = ["templates", "build-1995", str(D1 / "PRE"), "--rig", str(D1 / "rig.json"), "--out", str(out)]
    done = CliRunner().invoke(cli, arguments)
    assert done.exit_code == 0, done.output
    assert "Proximity of edge templates" in done.output
    made, ships = read_trees(out.read_bytes()), default_trees()
    assert made.diameter_px == ships.diameter_px
    for space, tree in ships.trees.items():
        assert made.trees[space].representatives == pytest.approx(tree.representatives, abs=1e-2)
