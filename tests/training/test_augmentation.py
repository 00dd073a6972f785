"""Light and truth turn with the patches."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs PyTorch, which the project does not install")

from spinewatch.arrays import Single  # noqa: E402
from spinewatch.detection.refinement.lighting import lighting_inputs  # noqa: E402
from spinewatch.simulation.images.examples import Examples  # noqa: E402
from spinewatch.simulation.images.families import FAMILIES  # noqa: E402
from training.augmentation import (  # noqa: E402
    LAMP_U,
    LAMP_V,
    LOG_HEIGHT,
    U,
    V,
    as_tensors,
    augmented,
    expected_light,
    turned,
)

if TYPE_CHECKING:
    from torch import Tensor

TURNS = list(product([False, True], repeat=3))
MIRRORED = [turn for turn in TURNS if not turn[2]]


def some_examples(n: int = 12) -> Examples:
    rng = np.random.default_rng(1)
    lamp, up = rng.uniform(-0.4, 0.4, (2, n, 2)).astype(np.float32)
    return Examples(
        patches=rng.normal(size=(n, 9, 9)).astype(np.float16),
        ball=rng.random(n) < 0.5,
        offset=rng.normal(size=(n, 2)).astype(np.float32),
        visible=rng.random(n).astype(np.float32),
        log_size=rng.normal(size=n).astype(np.float32),
        up=up,
        lamp=lamp,
        log_height=rng.normal(2.0, 0.3, n).astype(np.float32),
        families=rng.random((n, len(FAMILIES))) < 0.5,
        image=np.arange(n) // 4,
    )


def light_of(lamp: Single, log_height: Single) -> Tensor:
    known = np.ones(len(lamp), dtype=bool)
    return torch.from_numpy(lighting_inputs(lamp.astype(float), known, log_height.astype(float), known))


def batch() -> tuple[Tensor, Tensor, Tensor]:
    patches, truth = as_tensors(some_examples())
    return patches[:, None], light_of(truth[:, [LAMP_U, LAMP_V]].numpy(), truth[:, LOG_HEIGHT].numpy()), truth


def turn_batch(
    parts: tuple[Tensor, Tensor, Tensor], turn: tuple[bool, bool, bool]
) -> tuple[Tensor, Tensor, Tensor]:
    return turned(*parts, mirror_u=turn[0], mirror_v=turn[1], transpose=turn[2])


def test_the_truth_has_one_column_for_each_number() -> None:
    examples = some_examples()
    patches, truth = as_tensors(examples)
    assert patches.shape == (12, 9, 9)
    assert truth.shape == (12, 8)
    assert np.array_equal(truth[:, [U, V]].numpy(), examples.offset)
    assert np.array_equal(truth[:, LOG_HEIGHT].numpy(), examples.log_height)


@pytest.mark.parametrize("turn", [*MIRRORED, (False, False, True)])
def test_mirroring_and_transposing_twice_are_the_identity(turn: tuple[bool, bool, bool]) -> None:
    before = batch()
    after = turn_batch(turn_batch(before, turn), turn)
    assert all(torch.equal(one, other) for one, other in zip(before, after, strict=True))


@pytest.mark.parametrize("turn", TURNS)
def test_a_bright_pixel_is_where_the_truth_says_after_every_turn(turn: tuple[bool, bool, bool]) -> None:
    patches, light, truth = batch()
    patches = torch.zeros_like(patches)
    truth[:, U], truth[:, V] = 3, -2
    patches[:, 0, 4 - 2, 4 + 3] = 1
    seen, _, true = turn_batch((patches, light, truth), turn)
    u, v = (int(true[0, column]) for column in (U, V))
    assert seen[0, 0, 4 + v, 4 + u] == 1


@pytest.mark.parametrize("turn", TURNS)
def test_the_light_is_that_of_the_turned_lamp(turn: tuple[bool, bool, bool]) -> None:
    _, light, truth = turn_batch(batch(), turn)
    expected = light_of(truth[:, [LAMP_U, LAMP_V]].numpy(), truth[:, LOG_HEIGHT].numpy())
    assert torch.allclose(light, expected, atol=1e-6)


def test_turning_leaves_the_batch_that_was_given() -> None:
    before, again = batch(), batch()
    turn_batch(before, (True, True, True))
    assert all(torch.equal(one, other) for one, other in zip(before, again, strict=True))


def test_the_same_seeds_augment_alike() -> None:
    examples = some_examples()
    patches, truth = as_tensors(examples)

    def once() -> tuple[Tensor, ...]:
        torch.manual_seed(3)
        return augmented(patches[:, None], truth, examples.up, np.random.default_rng(4))

    assert all(torch.equal(one, other) for one, other in zip(once(), once(), strict=True))
    assert expected_light(examples.up).shape == once()[1].shape == (12, 7)
