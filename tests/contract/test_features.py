import numpy as np
import pytest

from contract.features import Feature, FeaturePair, FieldPair
from spinewatch.detection.candidates.surgical_field import SurgicalField
from spinewatch.detection.features import Features

SOME = Features(
    np.array([[10.0, 20], [30, 40]]),
    np.array([0.75, 0.5]),
    np.array([[[0.16, 0.01], [0.01, 0.36]], [[0.04, -0.02], [-0.02, 0.09]]]),
    np.array([0.5, 1.0]),
    np.array([False, True]),
)


def test_features_come_back_as_they_were() -> None:
    pair = FeaturePair.model_validate_json(FeaturePair.of(SOME, Features.empty()).model_dump_json())
    left, right = pair.library()
    for name in ("xy_px", "score", "visible"):
        np.testing.assert_array_equal(getattr(left, name), getattr(SOME, name))
    np.testing.assert_allclose(left.covariance_px2, SOME.covariance_px2, rtol=1e-14)
    assert left.is_manual.tolist() == [False, True]
    assert (len(right), right.covariance_px2.shape) == (0, (0, 2, 2))


def test_features_without_a_visible_fraction() -> None:
    plain = Features.with_sigma(np.array([[1.0, 2]]), np.array([0.5]), 0.3)
    (feature,) = Feature.of(plain)
    assert (feature.visible_fraction, feature.manual) == (None, False)
    assert feature.correlation == pytest.approx(0)
    assert FeaturePair.of(plain, plain).library()[0].visible is None


def test_fields_are_boxes() -> None:
    fields = FieldPair.of(SurgicalField(1, 2, 3, 4), SurgicalField(5, 6, 7, 8))
    assert (fields.left, fields.right) == ([1, 2, 3, 4], [5, 6, 7, 8])
