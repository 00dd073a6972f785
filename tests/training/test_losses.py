"""The loss is least at the truth, and the deviations that a network states count."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

torch = pytest.importorskip("torch", reason="training needs PyTorch, which the project does not install")

from spinewatch.detection.refinement.networks import OUTPUTS, SCALES  # noqa: E402
from training.augmentation import BALL, VISIBLE, U  # noqa: E402
from training.losses import batch_loss, by_name, centre_chi2  # noqa: E402

if TYPE_CHECKING:
    from torch import Tensor


def case(n: int = 4) -> tuple[Tensor, Tensor]:
    """Return outputs and the truth that they state."""
    outputs, truth = torch.zeros(n, len(OUTPUTS)), torch.zeros(n, 8)
    truth[:, BALL] = 1
    truth[:, VISIBLE] = 0.5
    return outputs, truth


def test_outputs_are_named_in_their_order() -> None:
    outputs = torch.arange(len(OUTPUTS), dtype=torch.float32)[None]
    assert {name: int(value) for name, value in by_name(outputs).items()} == {
        name: k for k, name in enumerate(OUTPUTS)
    }


def test_an_error_of_one_standard_deviation_is_chi_square_one() -> None:
    outputs, truth = case()
    truth[:, U] = float(torch.exp(torch.tensor(-SCALES.log_precision)))
    assert centre_chi2(by_name(outputs), truth).tolist() == pytest.approx([1.0] * 4)


def test_errors_make_the_loss_larger_only_where_there_is_a_ball() -> None:
    outputs, truth = case()
    truth[2:, BALL] = 0
    with_ball, without = truth.clone(), truth.clone()
    with_ball[0, U], without[3, U] = 1, 1
    usual = batch_loss(outputs, truth)
    assert batch_loss(outputs, with_ball) > usual
    assert batch_loss(outputs, without) == usual
