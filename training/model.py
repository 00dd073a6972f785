"""The layers of a ball network while it is fitted, and the network of the library that they become."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from spinewatch.arrays import Single
from spinewatch.detection.refinement.lighting import N_INPUTS
from spinewatch.detection.refinement.network_graph import Layer
from spinewatch.detection.refinement.networks import OUTPUTS, BallNetwork
from spinewatch.detection.refinement.patches import PatchGrid


@dataclass(frozen=True)
class Architecture:
    """The architecture of a network.

    Attributes
    ----------
    grid
        Samples of its patches.
    min_width_px
        Least width of balls that it is for, px.
    sees_others
        Whether the mean patch of the other balls is its second image.
    convolutions
        (size, stride, channels) of each convolution.
    hidden
        Units of each of the two hidden layers.
    """

    grid: PatchGrid
    min_width_px: float
    sees_others: bool
    convolutions: tuple[tuple[int, int, int], ...]
    hidden: int


@dataclass(frozen=True, eq=False)
class BallModel:
    """The layers of a network; the light is added at the first hidden one.

    Attributes
    ----------
    convolutions
        The convolutions.
    first, second
        The hidden layers.
    lighting
        The layer of the inputs of the light.
    last
        The layer of the outputs.
    """

    convolutions: nn.Sequential
    first: nn.Linear
    lighting: nn.Linear
    second: nn.Linear
    last: nn.Linear

    @property
    def parameters(self) -> list[Tensor]:
        """All weights, in the order of the layers."""
        parts = (self.convolutions, self.first, self.lighting, self.second, self.last)
        return [parameter for part in parts for parameter in part.parameters()]

    def __call__(self, patches: Tensor, lighting: Tensor) -> Tensor:
        """Return the outputs (n, k) of patches (n, channels in, size, size) with the inputs (n, 7) of the light."""
        in_order = patches.contiguous(memory_format=torch.channels_last)
        hidden = torch.relu(self.first(self.convolutions(in_order).flatten(1)) + self.lighting(lighting))
        return self.last(torch.relu(self.second(hidden)))


def random_model(architecture: Architecture) -> BallModel:
    """Return a model with random weights, drawn by PyTorch.

    Parameters
    ----------
    architecture
        Architecture of the network.

    Returns
    -------
    BallModel
        The model.
    """
    steps: list[nn.Module] = []
    size, channels = architecture.grid.size, 1 + architecture.sees_others
    for kernel, stride, out in architecture.convolutions:
        steps += [nn.Conv2d(channels, out, kernel, stride), nn.ReLU()]
        size, channels = (size - kernel) // stride + 1, out
    hidden = architecture.hidden
    return BallModel(
        nn.Sequential(*steps).to(memory_format=torch.channels_last),
        nn.Linear(channels * size * size, hidden),
        nn.Linear(N_INPUTS, hidden, bias=False),
        nn.Linear(hidden, hidden),
        nn.Linear(hidden, len(OUTPUTS)),
    )


def ball_network(architecture: Architecture, model: BallModel) -> BallNetwork:
    """Return a fitted model as the library evaluates it.

    Parameters
    ----------
    architecture
        Its architecture.
    model
        The model.

    Returns
    -------
    BallNetwork
        The network.
    """
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
    lighting = np.ascontiguousarray(model.lighting.weight.detach().numpy().T)
    layers.append(Layer(np.ascontiguousarray(dense), _array(model.first.bias), 1, lighting))
    layers += [
        Layer(part.weight.detach().numpy().T[None, None].copy(), _array(part.bias), 1)
        for part in (model.second, model.last)
    ]
    return BallNetwork(architecture.grid, architecture.min_width_px, tuple(layers))


def _array(values: Tensor) -> Single:
    """Return a tensor as an array."""
    return np.asarray(values.detach().numpy(), dtype=np.float32)
