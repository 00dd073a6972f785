import json
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

from commands.main import cli
from spinewatch.detection.candidates.property_spaces import PropertySpace
from spinewatch.detection.candidates.search import DetectionParameters
from spinewatch.detection.candidates.template_building import (
    AnnotatedView,
    BuildParameters,
    build_template_set,
    class_silhouettes,
    clutter_covariance,
    whiten,
)
from spinewatch.detection.candidates.templates import (
    Side,
    TemplateError,
    default_template_set,
    normalise_samples,
    read_template_set,
)
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
    for side in get_args(Side):
        assert len(trees[side, PropertySpace.GRAY].representatives) == 6
        assert len(trees[side, PropertySpace.EDGE].representatives) == 4
        assert f"Proximity of {side} gray templates" in printed
    assert "silhouette" in printed


def test_the_number_of_classes_is_that_of_the_kinds_of_samples() -> None:
    rng = np.random.default_rng(0)

    def side() -> NDArray[np.floating]:
        kinds = rng.normal(size=(3, 1, 19, 19))
        samples = np.concatenate([kind + 0.2 * rng.normal(size=(5, 1, 19, 19)) for kind in kinds])
        return normalise_samples(PropertySpace.GRAY, samples, np.ones((19, 19)))

    values = class_silhouettes([side(), side()], most=8)
    assert list(values) == list(range(2, 9))
    assert max(values, key=values.__getitem__) == 3


def test_two_balls_a_side_make_no_classes() -> None:
    samples = np.random.default_rng(0).normal(size=(2, 1, 19, 19))
    with pytest.raises(TemplateError, match="three balls"):
        class_silhouettes([normalise_samples(PropertySpace.GRAY, samples, np.ones((19, 19)))], most=8)


def test_whitening_turns_a_template_away_from_what_clutter_looks_like() -> None:
    mask = np.ones((5, 5))
    stripes = np.tile(np.sin(np.arange(5)), (5, 1))[None, None]
    dot = np.zeros((1, 1, 5, 5))
    dot[0, 0, 2, 2] = 1.0
    clutter = np.outer(stripes.ravel(), stripes.ravel())
    (white,) = whiten(dot + stripes, mask, clutter, ridge=0.01)
    assert abs(np.sum(white * stripes)) < 0.2 * abs(np.sum((dot + stripes) * stripes)) / np.linalg.norm(
        dot + stripes
    )
    assert np.linalg.norm(white) == pytest.approx(1)


def test_clutter_covariance_is_that_of_patches_laid_anywhere() -> None:
    rng = np.random.default_rng(0)
    noise = rng.normal(size=(2, 300, 300)).astype(np.float32)
    smooth = noise + np.roll(noise, 1, axis=2)
    covariance = clutter_covariance([smooth], np.ones((3, 3)))
    correlation = covariance / covariance[0, 0]
    assert np.allclose(np.diag(correlation), 1, atol=0.05)
    assert correlation[0, 1] == pytest.approx(0.5, abs=0.05)  # its neighbour in u
    assert correlation[0, 3] == pytest.approx(0.0, abs=0.05)  # its neighbour in v
    assert correlation[0, 9] == pytest.approx(0.0, abs=0.05)  # the other plane


def test_views_of_one_side_only_are_refused() -> None:
    truth = json.loads((D1 / "PRE" / "truth.json").read_text())
    centres = np.array([b["left"]["center_px"] for t in truth["triads"] for b in t["balls"].values()])
    image = np.random.default_rng(0).integers(0, 255, (416, 568)).astype(np.uint8)
    view = AnnotatedView(image, "left", centres, np.full((len(centres), 2), 9.0))
    with pytest.raises(TemplateError, match="both"):
        build_template_set([view], "v", BuildParameters(), DetectionParameters())
