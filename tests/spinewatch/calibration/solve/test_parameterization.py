import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.calibration.solve.block import Block
from spinewatch.calibration.solve.collinearity import EXTERIOR_NAMES, camera_vector
from spinewatch.calibration.solve.parameterization import Parameterization, linearize
from tests.spinewatch.calibration.simulated import IDENTITY, TABLE_3_3, image, moved_board

seeds = st.integers(0, 2**32 - 1)
PLACEMENTS = (IDENTITY, moved_board(3))
FREE = [
    ((*EXTERIOR_NAMES, "f", "x0", "y0", "K1", "aspect"), (*EXTERIOR_NAMES, "x0", "P1")),
    (("X0", "Y0", "omega", "f"), ()),
]


def block(free: tuple[tuple[str, ...], ...]) -> Block:
    cameras = (TABLE_3_3.left, TABLE_3_3.right)
    images = {
        (c, s): image(camera, placement=placement, sigma_px=0.3, seed=2 * c + s)
        for c, camera in enumerate(cameras)
        for s, placement in enumerate(PLACEMENTS)
    }
    return Block(cameras, PLACEMENTS, images, free)


@pytest.mark.parametrize("free", FREE)
def test_unpacking_what_was_packed_gives_the_block_again(free: tuple[tuple[str, ...], ...]) -> None:
    b = block(free)
    p = Parameterization.of(b)
    again = p.unpack(p.pack())
    for camera, same in zip(b.cameras, again.cameras, strict=True):
        assert np.allclose(camera_vector(camera), camera_vector(same), rtol=1e-12, atol=1e-12)
    for placement, same_placement in zip(b.placements, again.placements, strict=True):
        assert np.allclose(placement.rotation, same_placement.rotation)


@pytest.mark.parametrize("free", FREE)
def test_held_parameters_stay_where_they_are(free: tuple[tuple[str, ...], ...]) -> None:
    b = block(free)
    p = Parameterization.of(b)
    x = p.pack() * (1 + 1e-3)
    for before, after, names in zip(b.cameras, p.unpack(x).cameras, free, strict=True):
        changed = camera_vector(after) != camera_vector(before)
        held = [n not in names for n in ("X0", "Y0", "Z0", "omega", "phi", "kappa", "f", "x0", "y0", "K1")]
        assert not np.any(changed[:10] & held)


@pytest.mark.parametrize("free", FREE)
@given(seed=seeds)
@settings(max_examples=10, deadline=None)
def test_the_jacobian_is_the_derivative_of_the_residuals(
    free: tuple[tuple[str, ...], ...], seed: int
) -> None:
    p = Parameterization.of(block(free))
    start = p.pack()
    rng = np.random.default_rng(seed)
    x = start + 1e-4 * rng.standard_normal(len(start)) * np.maximum(np.abs(start), 0.1)
    at = linearize(p, x)
    for i in range(len(x)):
        h = 1e-6 * max(abs(x[i]), 1e-2)
        step = h * np.eye(len(x))[i]
        numeric = (linearize(p, x + step).residuals - linearize(p, x - step).residuals) / (2 * h)
        assert np.abs(numeric - at.jacobian_by_x[:, i]).max() < 1e-4 * max(1.0, np.abs(numeric).max())


def test_residuals_are_computed_less_measured_over_the_standard_deviations() -> None:
    b = block(FREE[0])
    p = Parameterization.of(b)
    residuals = linearize(p, p.pack()).residuals
    for (c, s), here in b.observation_slices.items():
        points = b.images[c, s]
        computed = b.cameras[c].project(b.placements[s](points.control_mm))
        assert np.allclose(residuals[here], ((computed - points.pixels) / points.sd_px[:, None]).ravel())


def test_unknowns_far_off_give_nan_instead_of_an_error() -> None:
    p = Parameterization.of(block(FREE[0]))
    x = p.pack()
    x[2] = 0.0
    assert np.any(np.isnan(linearize(p, x).residuals))
