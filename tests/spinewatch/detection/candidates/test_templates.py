import numpy as np
import pytest

from spinewatch.detection.candidates.property_spaces import PropertySpace
from spinewatch.detection.candidates.templates import (
    HALF,
    TemplateError,
    default_template_set,
    read_template_set,
    write_template_set,
)


def test_a_set_survives_its_file() -> None:
    templates = default_template_set()
    again = read_template_set(write_template_set(templates))
    assert again.version == templates.version
    assert again.diameter_px == templates.diameter_px
    for key, tree in templates.trees.items():
        assert np.array_equal(again.trees[key].roots, tree.roots)
        assert np.array_equal(again.trees[key].mask, tree.mask)


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04", b"not a file"])
def test_other_files_are_refused(data: bytes) -> None:
    with pytest.raises(TemplateError):
        read_template_set(data)


def test_scaling_keeps_the_shape_and_grows_the_mask() -> None:
    tree = default_template_set().trees["left", PropertySpace.DIRECTIVITY]
    double = tree.scaled([(2.0, 2.0), (1.0, 1.0)])
    assert double.mask.sum() == pytest.approx(4 * tree.mask.sum(), rel=0.1)
    assert double.mask[0].any()
    assert double.mask[:, 0].any()
    assert double.roots.shape == (2, 2, *double.mask.shape)
    a, b = (n // 2 for n in double.mask.shape)
    same = np.s_[:, a - HALF : a + HALF + 1, b - HALF : b + HALF + 1]
    assert double.roots[1][same] == pytest.approx(tree.roots[0], abs=1e-6)
    inner = np.s_[:, HALF - a // 2 : HALF + a // 2 + 1, HALF - b // 2 : HALF + b // 2 + 1]
    assert double.roots[0][:, a % 2 :: 2, b % 2 :: 2] == pytest.approx(tree.roots[0][inner], abs=1e-6)
