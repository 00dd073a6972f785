import numpy as np
import pytest

from spinewatch.detection.features import Features
from spinewatch.simulation.rigs import table_3_3_rig


def some(n: int) -> Features:
    rng = np.random.default_rng(0)
    return Features.with_sigma(rng.uniform(100, 300, (n, 2)), np.linspace(0.9, 0.1, n), 0.2)


def test_features_of_one_sigma_have_its_covariance() -> None:
    features = some(3)
    assert len(features) == 3
    assert features.covariance_px2 == pytest.approx(np.tile(0.04 * np.eye(2), (3, 1, 1)))
    assert features.visible is None


def test_a_selection_keeps_all_columns_together() -> None:
    features = some(4)
    seen = Features(features.xy_px, features.score, features.covariance_px2, np.array([0.1, 0.2, 0.3, 0.4]))
    some_of_them = seen.take(np.array([False, True, False, True]))
    assert np.array_equal(some_of_them.xy_px, features.xy_px[[1, 3]])
    assert np.array_equal(some_of_them.score, features.score[[1, 3]])
    assert some_of_them.visible is not None
    assert some_of_them.visible.tolist() == [0.2, 0.4]
    assert len(features.take(np.array([], dtype=np.intp))) == 0


def test_the_best_features_have_the_highest_scores_and_are_in_their_order() -> None:
    features = some(4)
    shuffled = features.take([2, 0, 3, 1])
    assert np.array_equal(shuffled.best(3).xy_px, features.xy_px[:3])
    assert len(shuffled.best(9)) == 4


def test_enlarged_deviations_grow_by_axis_and_centres_stay() -> None:
    features = some(3)
    assert features.enlarged(1.0) is features
    larger = features.enlarged(np.array([2.0, 1.0]), (0.0, 0.3))
    assert larger.xy_px is features.xy_px
    assert larger.covariance_px2 == pytest.approx(np.tile(np.diag([0.16, 0.13]), (3, 1, 1)))
    assert features.enlarged(3.0).covariance_px2 == pytest.approx(9 * features.covariance_px2)


def test_rays_pass_through_the_features() -> None:
    camera = table_3_3_rig().left
    features = some(5)
    rays = features.rays(camera)
    points = camera.centre + 80 * rays.vectors
    assert camera.project(points) == pytest.approx(features.xy_px, abs=1e-6)
    assert np.all(
        features.rays(camera, extra_sd_mrad=1.0).covariance_mm2[:, 0, 0] > rays.covariance_mm2[:, 0, 0]
    )


def test_no_features_have_length_zero() -> None:
    assert len(Features.empty()) == 0
