import numpy as np
import pytest

from spinewatch.detection.refinement.other_balls import MIN_OTHERS, PatchSums, mean_of_other_balls

RNG = np.random.default_rng(1)


def test_the_mean_is_that_of_the_other_balls_of_the_image() -> None:
    image = np.repeat([0, 1, 3], [6, 9, 5])  # examples of an image may be left out
    patches = RNG.normal(size=(20, 4, 4)).astype(np.float32)
    is_ball = RNG.random(20) < 0.8
    seen = PatchSums.per_image(patches, is_ball, image).mean_of_others(patches, is_ball, image)
    for i in range(20):
        others = is_ball & (image == image[i]) & (np.arange(20) != i)
        expected = patches[others].mean(axis=0) if others.sum() >= MIN_OTHERS else np.zeros((4, 4))
        assert seen[i] == pytest.approx(expected, abs=1e-5)


def test_a_patch_does_not_change_its_own_mean() -> None:
    patches = RNG.normal(size=(8, 3, 3)).astype(np.float32)
    is_ball = np.ones(8, dtype=bool)
    other = patches.copy()
    other[2] += 5
    before, after = (mean_of_other_balls(values, is_ball)[2] for values in (patches, other))
    assert after == pytest.approx(before, abs=1e-5)


@pytest.mark.parametrize("known", [0, MIN_OTHERS])
def test_the_mean_is_unknown_with_too_few_others(known: int) -> None:
    patches = RNG.normal(size=(7, 3, 3)).astype(np.float32)
    is_ball = np.arange(7) < known
    mean = mean_of_other_balls(patches, is_ball)
    assert not mean[is_ball].any()
    assert mean[~is_ball].any() == (known >= MIN_OTHERS)


def test_no_patches_have_no_means() -> None:
    assert mean_of_other_balls(np.empty((0, 5, 5), np.float32), np.empty(0, dtype=bool)).shape == (0, 5, 5)
