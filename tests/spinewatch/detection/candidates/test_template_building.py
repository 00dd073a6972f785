import json

import numpy as np
import pytest
from numpy.typing import NDArray

from spinewatch.detection.candidates.property_spaces import PropertySpace
from spinewatch.detection.candidates.search import DetectionParameters
from spinewatch.detection.candidates.template_building import (
    AnnotatedView,
    BuildParameters,
    build_template_set,
    class_silhouettes,
)
from spinewatch.detection.candidates.template_samples import normalize_samples
from spinewatch.detection.candidates.templates import TemplateError
from spinewatch.imaging.decoding import decode_image
from spinewatch.imaging.frame import SIDES, Frame
from tests.paths import SAMPLES

D1 = SAMPLES / "D1"


@pytest.fixture(scope="module")
def views() -> list[AnnotatedView]:
    """The sample surgery's first stage."""
    truth = json.loads((D1 / "PRE" / "truth.json").read_text())
    views = []
    for side in SIDES:
        centres = np.array([b[side]["center_px"] for t in truth["triads"] for b in t["balls"].values()])
        frame = Frame(decode_image((D1 / "PRE" / f"{side}.png").read_bytes()), side)
        views.append(AnnotatedView(frame, centres, np.full((len(centres), 2), (9.1, 10.8))))
    return views


def test_a_set_has_the_asked_classes_and_a_whitened_root(views: list[AnnotatedView]) -> None:
    parameters = BuildParameters(gray_classes=3, edge_classes=2)
    built = build_template_set(views, "new", parameters, DetectionParameters())
    assert built.templates.version == "new"
    assert set(built.silhouettes) == {PropertySpace.DIRECTIVITY}
    for side in SIDES:
        trees = {space: built.templates.trees[side, space] for space in PropertySpace}
        assert len(trees[PropertySpace.GRAY].representatives) == 3
        assert len(trees[PropertySpace.EDGE].representatives) == 2
        mean = {space: tree.representatives.mean(axis=0) for space, tree in trees.items()}
        assert trees[PropertySpace.GRAY].roots[0] == pytest.approx(mean[PropertySpace.GRAY], abs=1e-6)
        white = trees[PropertySpace.DIRECTIVITY].roots[0]
        assert np.linalg.norm(white) == pytest.approx(1, abs=1e-5)
        assert white != pytest.approx(mean[PropertySpace.DIRECTIVITY], abs=0.01)


def test_the_number_of_classes_is_that_of_the_kinds_of_samples() -> None:
    rng = np.random.default_rng(0)

    def side() -> NDArray[np.floating]:
        kinds = rng.normal(size=(3, 1, 19, 19))
        samples = np.concatenate([kind + 0.2 * rng.normal(size=(5, 1, 19, 19)) for kind in kinds])
        return normalize_samples(PropertySpace.GRAY, samples, np.ones((19, 19)))

    values = class_silhouettes([side(), side()], max_classes=8)
    assert list(values) == list(range(2, 9))
    assert max(values, key=values.__getitem__) == 3


def test_two_balls_per_side_make_no_classes() -> None:
    samples = np.random.default_rng(0).normal(size=(2, 1, 19, 19))
    with pytest.raises(TemplateError, match="three balls"):
        class_silhouettes([normalize_samples(PropertySpace.GRAY, samples, np.ones((19, 19)))], max_classes=8)


def test_views_of_one_side_only_are_refused(views: list[AnnotatedView]) -> None:
    with pytest.raises(TemplateError, match="both"):
        build_template_set(views[:1], "v", BuildParameters(), DetectionParameters())
