import numpy as np
import pytest

from spinewatch.detection.candidates.property_spaces import PropertySpace
from spinewatch.detection.candidates.template_building import AnnotatedView
from spinewatch.detection.candidates.template_samples import tree_proximities
from spinewatch.detection.candidates.templates import TemplateError
from spinewatch.imaging.frame import Frame
from spinewatch.thesis_1995.template_trees import (
    TreeParameters,
    build_trees,
    default_trees,
    read_trees,
    write_trees,
)


def test_the_trees_have_six_gray_and_four_edge_classes_of_raw_gray_levels() -> None:
    trees = default_trees().trees
    assert len(trees[PropertySpace.GRAY].representatives) == 6
    assert len(trees[PropertySpace.EDGE].representatives) == 4
    assert trees[PropertySpace.GRAY].representatives.min() > 1  # gray levels, not normalized


def test_the_root_is_the_average_of_the_representatives() -> None:
    for tree in default_trees().trees.values():
        assert tree.roots[0] == pytest.approx(tree.representatives.mean(axis=0), abs=1e-3)


def test_the_gray_proximities_are_those_of_table_4_2() -> None:
    printed = [0.9893, 0.9673, 0.9836, 0.9711, 0.9748, 0.9830, 0.9831]
    ours = tree_proximities(default_trees().trees[PropertySpace.GRAY]).mean(axis=0)
    assert sorted(ours) == pytest.approx(sorted(printed), abs=0.015)


def test_the_contents_of_a_file_are_read_back() -> None:
    trees = default_trees()
    again = read_trees(write_trees(trees))
    assert again.diameter_px == trees.diameter_px
    for space, tree in trees.trees.items():
        assert np.array_equal(again.trees[space].mask, tree.mask)


def test_another_file_is_refused_by_name() -> None:
    with pytest.raises(TemplateError, match="build-1995"):
        read_trees(b"no templates")


def test_fewer_balls_than_classes_are_refused() -> None:
    rng = np.random.default_rng(1)
    frame = Frame(rng.integers(0, 255, (60, 80)).astype(np.uint8), "left")
    view = AnnotatedView(frame, np.array([[30.0, 30.0]]), np.array([[9.0, 10.0]]))
    with pytest.raises(TemplateError, match="6 template classes"):
        build_trees([view], TreeParameters())


def test_scaled_trees_have_larger_masks() -> None:
    trees = default_trees()
    double = trees.scaled((2 * trees.diameter_px[0], 2 * trees.diameter_px[1]))
    for space, tree in trees.trees.items():
        assert double.trees[space].mask.sum() == pytest.approx(4 * tree.mask.sum(), rel=0.1)
