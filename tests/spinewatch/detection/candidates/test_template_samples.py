import numpy as np
import pytest
from numpy.typing import NDArray

from spinewatch.detection.candidates.property_spaces import PropertySpace
from spinewatch.detection.candidates.template_samples import (
    build_tree,
    cut_samples,
    normalize_samples,
    proximity_matrix,
    round_mask,
    tree_proximities,
)
from spinewatch.detection.candidates.templates import HALF, TemplateError

MASK = round_mask((9.0, 10.65), 1.38)


def two_kinds(count: int = 6) -> NDArray[np.float64]:
    rng = np.random.default_rng(0)
    kinds = rng.normal(size=(2, 1, 19, 19))
    return np.concatenate([kind + 0.05 * rng.normal(size=(count, 1, 19, 19)) for kind in kinds])


def test_clusters_are_the_kinds_of_samples() -> None:
    tree = build_tree(PropertySpace.GRAY, two_kinds(), MASK, n_classes=2)
    proximity = proximity_matrix(tree.representatives)
    assert np.allclose(np.diag(proximity), 1)
    assert abs(proximity[0, 1]) < 0.5
    assert tree.roots[0] == pytest.approx(tree.representatives.mean(axis=0), abs=1e-6)


def test_proximities_begin_with_the_mean_of_the_representatives() -> None:
    tree = build_tree(PropertySpace.GRAY, two_kinds(), MASK, n_classes=2)
    matrix = tree_proximities(tree)
    assert matrix[1:, 1:] == pytest.approx(proximity_matrix(tree.representatives))
    a, b = (kind / np.linalg.norm(kind) for kind in tree.representatives)
    root = tree.representatives.mean(axis=0)
    assert matrix[0, 1:] == pytest.approx([np.sum(root * k) / np.linalg.norm(root) for k in (a, b)], abs=1e-6)
    assert np.allclose(matrix, matrix.T)


@pytest.mark.parametrize("space", list(PropertySpace))
def test_normalized_samples_do_not_depend_on_light_and_contrast(space: PropertySpace) -> None:
    planes = 2 if space is PropertySpace.DIRECTIVITY else 1
    samples = np.random.default_rng(0).normal(size=(3, planes, 19, 19))
    unit = normalize_samples(space, samples, MASK)
    assert np.linalg.norm(unit.reshape(3, -1), axis=1) == pytest.approx(1)
    assert np.all(unit[..., MASK == 0] == 0)
    offset = 0 if space is PropertySpace.DIRECTIVITY else 5
    assert normalize_samples(space, 7 * samples + offset, MASK) == pytest.approx(unit)


def test_too_few_or_flat_samples_are_refused() -> None:
    with pytest.raises(TemplateError, match="classes"):
        build_tree(PropertySpace.GRAY, two_kinds(1), MASK, n_classes=3)
    with pytest.raises(TemplateError, match="flat"):
        build_tree(PropertySpace.GRAY, np.ones((4, 1, 19, 19)), MASK, n_classes=2)


def test_samples_are_cut_about_sub_pixel_centres() -> None:
    y, x = np.mgrid[:60, :80].astype(np.float32)
    (patch,) = cut_samples(np.stack([x, y]), [(40.25, 30.5)], (0.5, 1.0))
    assert patch[0, HALF, HALF] == pytest.approx(40.25)
    assert patch[0, HALF, HALF + 1] == pytest.approx(42.25)
    assert patch[1, HALF + 1, HALF] == pytest.approx(31.5)
