"""What networks see of the other balls while they are fitted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs PyTorch, which the project does not install")

from spinewatch.detection.refinement.other_balls import mean_of_other_balls  # noqa: E402
from spinewatch.detection.refinement.patches import PatchGrid  # noqa: E402
from tests.training.test_augmentation import some_examples  # noqa: E402
from training.model import Architecture  # noqa: E402
from training.others import SeenExamples  # noqa: E402

ALONE, WITH_OTHERS = (
    Architecture(PatchGrid(9, 2.0), 0.0, others, ((3, 1, 4),), 8) for others in (False, True)
)


def test_a_network_that_sees_no_others_sees_the_patch_alone() -> None:
    seen = SeenExamples.of(some_examples(), ALONE)
    assert seen.some_known(np.random.default_rng(1)) is seen
    assert seen.images(torch.arange(5)).shape == (5, 1, 9, 9)


def test_the_second_image_is_the_mean_that_the_detector_computes() -> None:
    n = 24
    examples = some_examples(n)
    examples = replace(examples, image=np.arange(n) // 8, ball=np.ones(n, dtype=bool))
    seen = SeenExamples.of(examples, WITH_OTHERS)
    batch = torch.tensor([9, 3, 20, 15])
    images = seen.images(batch).numpy()
    assert np.array_equal(images[:, 0], seen.patches[batch].numpy())
    for image, index in zip(images, batch.tolist(), strict=True):
        of_image = examples.image == examples.image[index]
        mean = mean_of_other_balls(seen.patches.numpy()[of_image], (examples.visible > 0.5)[of_image])
        assert image[1] == pytest.approx(mean[index % 8], abs=1e-6)


def test_which_balls_are_known_is_a_random_choice() -> None:
    n = 4000
    examples = replace(some_examples(n), image=np.arange(n) // 8)
    seen = SeenExamples.of(examples, WITH_OTHERS)
    in_view = examples.ball & (examples.visible > 0.5)
    assert np.array_equal(seen.is_known, in_view)
    one, other = (seen.some_known(np.random.default_rng(seed)).is_known for seed in (1, 2))
    assert not np.array_equal(one, other)
    assert 0.4 < one[in_view].mean() < 0.65
    assert not one[examples.ball & ~in_view].any()
    assert 0 < one[~examples.ball].mean() < 0.03
