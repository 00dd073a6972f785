"""Fits a ball network to examples: a ball or not, its centre with covariance, visible fraction, size, and the lamp.

Centres are weighed by the likelihood of Student's t about the predicted place with the predicted covariance, so that
the network learns where it cannot know: Kendall and Gal, What uncertainties do we need in Bayesian deep learning for
computer vision, 2017, with a heavier tail for examples that nobody could place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from rich.progress import Progress
from torch import Tensor, nn
from torch.nn import functional

from spinewatch.detection.refinement.networks import OUTPUTS, UNITS, BallNet, Layer, normalise
from spinewatch.detection.refinement.patches import PatchGrid
from spinewatch.simulation.images.examples import Examples

BATCH = 256
RATE = 2.5e-3
HELD_OUT = 3000
"""Examples that are not learnt from; their errors are printed."""
TOLD_SD, MEASURED_SD = 0.04, 0.03
"""How uncertainly it is told where the lamp should hang, and where it does, on the unit sphere."""
_HALF = 0.5


@dataclass(frozen=True)
class Architecture:
    """What a network is made of.

    The patches' ``grid``; ``from_px``, the least width of balls it is for; ``convolutions`` (size, stride, channels);
    units of the ``hidden`` layers.
    """

    grid: PatchGrid
    from_px: float
    convolutions: tuple[tuple[int, int, int], ...]
    hidden: int


@dataclass(frozen=True, eq=False)
class _Model:
    """The layers; the lamp's direction joins at the first hidden one."""

    convolutions: nn.Sequential
    first: nn.Linear
    lamp: nn.Linear
    second: nn.Linear
    last: nn.Linear

    @property
    def parameters(self) -> list[Tensor]:
        parts = (self.convolutions, self.first, self.lamp, self.second, self.last)
        return [parameter for part in parts for parameter in part.parameters()]

    def __call__(self, patches: Tensor, lamp: Tensor) -> Tensor:
        hidden = torch.relu(self.first(self.convolutions(patches).flatten(1)) + self.lamp(lamp))
        return self.last(torch.relu(self.second(hidden)))


def fit(
    architecture: Architecture, examples: Examples, epochs: int, seed: int, progress: Progress
) -> BallNet:
    """Return the network trained on all but the last examples, whose errors are printed."""
    torch.manual_seed(seed)
    model = _model(architecture)
    x = torch.from_numpy(normalise(examples.patches.astype(np.float32)))[:, None]
    up = torch.from_numpy(np.column_stack([examples.up, np.zeros(len(x), np.float32)]))
    columns = [examples.ball, examples.offset, examples.visible, examples.log_size, examples.lamp]
    truth = torch.from_numpy(np.column_stack(columns).astype(np.float32))
    learnt = len(x) - HELD_OUT
    batches = learnt // BATCH
    optimizer = torch.optim.AdamW(model.parameters, lr=RATE, weight_decay=1e-3)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, RATE, total_steps=epochs * batches)
    task = progress.add_task(f"fit {architecture.grid.size} x {architecture.grid.size}", total=epochs)
    for _ in range(epochs):
        order = torch.randperm(learnt)
        for batch in order[: batches * BATCH].split(BATCH):
            some = _turned(x[batch], _told(up[batch], truth[batch, 5:]), truth[batch])
            optimizer.zero_grad()
            _loss(model(some[0], some[1]), some[2]).backward()
            optimizer.step()
            schedule.step()
        progress.advance(task)
    with torch.no_grad():
        progress.console.print(_report(model(x[learnt:], up[learnt:]), truth[learnt:]))
    return _exported(architecture, model)


def _model(architecture: Architecture) -> _Model:
    steps: list[nn.Module] = []
    size, channels = architecture.grid.size, 1
    for kernel, stride, out in architecture.convolutions:
        steps += [nn.Conv2d(channels, out, kernel, stride), nn.ReLU()]
        size, channels = (size - kernel) // stride + 1, out
    hidden = architecture.hidden
    return _Model(
        nn.Sequential(*steps),
        nn.Linear(channels * size * size, hidden),
        nn.Linear(3, hidden, bias=False),
        nn.Linear(hidden, hidden),
        nn.Linear(hidden, len(OUTPUTS)),
    )


def _told(up: Tensor, lamp: Tensor) -> Tensor:
    """Return (n, 3) what is told of the lamp: for half of the examples where it does hang, and that this is known."""
    known = (torch.rand(len(up), 1) < 0.5).float()
    should = up[:, :2] + TOLD_SD * torch.randn(len(up), 2)
    does = lamp + MEASURED_SD * torch.randn(len(up), 2)
    return torch.cat([known * does + (1 - known) * should, known], dim=1)


def _turned(patches: Tensor, lamp: Tensor, truth: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Return a batch mirrored and transposed at random: light falls from any side."""
    lamp, truth = lamp.clone(), truth.clone()
    right, down, swap = (torch.rand(3) < 0.5).tolist()
    if right:
        patches, lamp[:, 0] = patches.flip(-1), -lamp[:, 0]
        truth[:, [1, 5]] *= -1
    if down:
        patches, lamp[:, 1] = patches.flip(-2), -lamp[:, 1]
        truth[:, [2, 6]] *= -1
    if swap:
        patches, lamp, truth = patches.transpose(-1, -2), lamp[:, [1, 0, 2]], truth[:, [0, 2, 1, 3, 4, 6, 5]]
    return patches, lamp, truth


def _loss(out: Tensor, truth: Tensor) -> Tensor:
    ball = truth[:, 0] > _HALF
    seen, of = out[ball], truth[ball]
    freedom = UNITS["freedom"]
    misfit = (freedom + 2) / 2 * torch.log1p(_squared(seen, of) / freedom) - seen[:, 3] - seen[:, 4]
    far = (of[:, 5:] - UNITS["lamp"] * seen[:, 8:10]).square().sum(dim=1) * torch.exp(2 * seen[:, 10] + 4)
    lamp_misfit = (freedom + 2) / 2 * torch.log1p(far / freedom) - 2 * seen[:, 10]
    return (
        misfit.mean()
        + 0.3 * lamp_misfit.mean()
        + 2 * functional.binary_cross_entropy_with_logits(out[:, 0], truth[:, 0])
        + 0.5 * functional.mse_loss(torch.sigmoid(seen[:, 6]), of[:, 3])
        + 20 * functional.smooth_l1_loss(UNITS["log_size"] * seen[:, 7], of[:, 4], beta=0.05)
    )


def _squared(seen: Tensor, of: Tensor) -> Tensor:
    """Return the squared error (n,) of centres over their predicted covariance."""
    du, dv = (of[:, 1:3] - UNITS["offset"] * seen[:, 1:3]).T
    a, b = (torch.exp(seen[:, i] + UNITS["log_precision"]) for i in (3, 4))
    return (a * du + seen[:, 5] * b * dv) ** 2 + (b * dv) ** 2


def _report(out: Tensor, truth: Tensor) -> str:
    clear = (truth[:, 0] > _HALF) & (truth[:, 3] > 0.9)
    error = (truth[clear, 1:3] - UNITS["offset"] * out[clear, 1:3]).abs()
    right = ((out[:, 0] > 0) == (truth[:, 0] > _HALF)).float().mean()
    chi2 = _squared(out[clear], truth[clear]).mean() / 2 * (UNITS["freedom"] - 2) / UNITS["freedom"]
    return (
        f"held out, lamp not known: median error {error.median():.4f} radii, RMS {error.square().mean().sqrt():.4f}, "
        f"chi2 / dof {chi2:.2f}, told from other things {right:.1%}"
    )


def _exported(architecture: Architecture, model: _Model) -> BallNet:
    kinds = [part for part in model.convolutions if isinstance(part, nn.Conv2d)]
    layers = [
        Layer(
            np.ascontiguousarray(part.weight.detach().numpy().transpose(2, 3, 1, 0)),
            _array(part.bias),
            stride,
        )
        for part, (_, stride, _) in zip(kinds, architecture.convolutions, strict=True)
    ]
    channels = architecture.convolutions[-1][2]
    size = int(np.sqrt(model.first.in_features // channels))
    dense = model.first.weight.detach().numpy().reshape(-1, channels, size, size).transpose(2, 3, 1, 0)
    lamp = np.ascontiguousarray(model.lamp.weight.detach().numpy().T)
    layers.append(Layer(np.ascontiguousarray(dense), _array(model.first.bias), 1, lamp))
    layers += [
        Layer(part.weight.detach().numpy().T[None, None].copy(), _array(part.bias), 1)
        for part in (model.second, model.last)
    ]
    return BallNet(architecture.grid, architecture.from_px, tuple(layers))


def _array(values: Tensor) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    return np.asarray(values.detach().numpy(), dtype=np.float32)
