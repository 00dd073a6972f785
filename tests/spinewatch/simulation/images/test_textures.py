import numpy as np
import pytest

from spinewatch.simulation.images.textures import random_textures


@pytest.mark.parametrize("seed", range(3))
def test_textures_have_zero_mean_and_unit_variance(seed: int) -> None:
    textures = random_textures(np.random.default_rng(seed), 4, 64)
    assert textures.shape == (4, 64, 64)
    assert textures.mean(axis=(1, 2)) == pytest.approx(0, abs=1e-4)
    assert textures.std(axis=(1, 2)) == pytest.approx(1, abs=1e-4)


def test_textures_are_smooth_also_across_their_borders() -> None:
    textures = random_textures(np.random.default_rng(0), 20, 64)
    inside = np.abs(np.diff(textures, axis=2)).mean(axis=(1, 2))
    border = np.abs(textures[:, :, 0] - textures[:, :, -1]).mean(axis=1)
    assert np.median(border / inside) == pytest.approx(1, abs=0.2)


def test_textures_differ_and_follow_from_the_seed() -> None:
    first, second = (random_textures(np.random.default_rng(1), 2, 32) for _ in range(2))
    assert np.array_equal(first, second)
    assert not np.array_equal(first[0], first[1])
