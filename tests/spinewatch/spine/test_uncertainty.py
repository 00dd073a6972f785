import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spinewatch.spine.orientation import tilt_gradients, tilts_of
from spinewatch.spine.uncertainty import (
    QUANTILE_95,
    angle_gradient,
    common_factors,
    errors_of,
    gradient,
    normal_interval,
)
from tests.spinewatch.spine.spines import errors, tilted

seeds = st.integers(0, 2**32 - 1)


def test_shared_sources_have_the_same_columns() -> None:
    spine = tilted([10.0, 0.0])
    first = spine.__class__(**{**vars(spine), "errors": {"initial": errors(2), "triads A": 2 * errors(2)}})
    second = spine.__class__(**{**vars(spine), "errors": {"triads B": errors(2), "initial": errors(2)}})
    a, b = common_factors((first, second))
    assert a.shape == b.shape == (2, 6, 36)
    assert np.array_equal(a[:, :, :12], b[:, :, :12])
    assert not a[:, :, 24:].any()
    assert not b[:, :, 12:24].any()
    assert common_factors((spine,))[0].shape == (2, 6, 1)


@settings(deadline=None, max_examples=30)
@given(seeds)
def test_differences_agree_with_the_gradients_of_the_tilts(seed: int) -> None:
    R = Rotation.from_rotvec(np.random.default_rng(seed).uniform(-0.6, 0.6, (2, 3))).as_matrix()
    for which in range(3):
        found = gradient(lambda c, S, k=which: tilts_of(S[..., 1, :, :])[k], np.zeros((2, 3)), R)  # type: ignore[misc]
        assert np.allclose(found[1, 3:], tilt_gradients(R[1])[which], atol=1e-6)
        assert not found[0].any()
        assert not found[1, :3].any()


def test_a_gradient_with_several_values() -> None:
    at = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    found = gradient(
        lambda c, R: np.stack([c[..., 0, 0], 3 * c[..., 1, 2]], -1), at, np.tile(np.eye(3), (2, 1, 1))
    )
    assert found.shape == (2, 6, 2)
    assert found[0, 0] == pytest.approx([1, 0])
    assert found[1, 2] == pytest.approx([0, 3])
    factor = np.zeros((2, 6, 2))
    factor[0, 0, 0], factor[1, 2, 1] = 0.5, 0.2
    assert errors_of(found, factor) == pytest.approx(np.diag([0.5, 0.6]))


def test_an_angle_at_180_degrees_has_a_finite_gradient() -> None:
    R = Rotation.from_rotvec([0, 0, np.pi]).as_matrix()[None]
    found = angle_gradient(lambda c, S: tilts_of(S[..., 0, :, :])[2], np.zeros((1, 3)), R)
    assert found[0, 5] == pytest.approx(1.0)


def test_a_normal_interval_contains_the_alternatives() -> None:
    assert normal_interval(3.0, 0.5) == pytest.approx((3 - 0.5 * QUANTILE_95, 3 + 0.5 * QUANTILE_95))
    assert normal_interval(np.array([3.0, 7.0, 1.0]), 0.0) == (1.0, 7.0)
