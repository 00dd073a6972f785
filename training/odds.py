"""Fitting of the odds of a ball to hard negatives.

A network fitted to places chosen at random states too high odds for the candidates of the detector, which are the
places of an image most like a ball. The weights of the log-odds in its last layer are fitted again, to examples whose
places without a ball a network takes for one. Its other outputs do not change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from scipy.optimize import minimize
from torch import Tensor
from torch.nn import functional

from spinewatch.arrays import Float, Single
from spinewatch.detection.refinement.network_graph import Layer
from spinewatch.detection.refinement.networks import OUTPUTS, BallNetwork
from spinewatch.simulation.images.examples import Examples
from training.fit import BATCH, as_tensors, augmented

RIDGE = 1e-4
"""Weight of the squares of the changes of the weights, for inputs of unit standard deviation."""

HELD_OUT = 0.1
"""Fraction of the examples that are not fitted to."""

_LOG_ODDS = OUTPUTS.index("log_odds")


@dataclass(frozen=True)
class OddsErrors:
    """How well log-odds hold on the held-out examples.

    Attributes
    ----------
    log_loss
        Mean negative logarithm of the chance of what is true.
    classified
        Fraction classified correctly.
    """

    log_loss: float
    classified: float

    def __str__(self) -> str:
        return f"log-loss {self.log_loss:.3f}, classified correctly {self.classified:.1%}"


def refit_odds(
    network: BallNetwork, examples: Examples, seed: int
) -> tuple[BallNetwork, OddsErrors, OddsErrors]:
    """Return a network whose log-odds are fitted to examples, and its errors on the last tenth of these.

    Parameters
    ----------
    network
        The network.
    examples
        Examples on its grid.
    seed
        Seed of the augmentation of the examples.

    Returns
    -------
    network : BallNetwork
        The same network with other weights of the log-odds.
    before, after : OddsErrors
        Errors of the log-odds before and after the fit.
    """
    torch.set_num_threads(1)
    hidden = _hidden(network.layers[:-1], examples, seed)
    X = np.column_stack([hidden, np.ones(len(hidden))]).astype(np.float64)
    y = examples.ball.astype(np.float64)
    last = network.layers[-1]
    before = np.append(last.weights[0, 0, :, _LOG_ODDS], last.bias[_LOG_ODDS]).astype(np.float64)
    held_out = slice(round((1 - HELD_OUT) * len(y)), None)
    after = _logistic_fit(X[: held_out.start], y[: held_out.start], before)
    weights, bias = last.weights.copy(), last.bias.copy()
    weights[0, 0, :, _LOG_ODDS], bias[_LOG_ODDS] = after[:-1], after[-1]
    layers = (*network.layers[:-1], replace(last, weights=weights, bias=bias))
    errors_before, errors_after = (_errors(X[held_out], y[held_out], w) for w in (before, after))
    return replace(network, layers=layers), errors_before, errors_after


def _hidden(layers: Sequence[Layer], examples: Examples, seed: int) -> Single:
    """Return the outputs (n, k) of rectified layers for augmented examples."""
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    patches, truth = as_tensors(examples)
    parts = []
    with torch.no_grad():
        for batch in torch.arange(len(patches)).split(BATCH):
            x, light, _ = augmented(patches[batch], truth[batch], examples.up[batch], rng)
            for layer in layers:
                x = torch.relu(_layer(layer, x, light))
            parts.append(x.flatten(1).numpy())
    return np.concatenate(parts)


def _layer(layer: Layer, x: Tensor, light: Tensor) -> Tensor:
    """Return the outputs of a layer before rectification."""
    kernel = torch.from_numpy(np.ascontiguousarray(layer.weights.transpose(3, 2, 0, 1)))
    out = functional.conv2d(x, kernel, torch.from_numpy(layer.bias), stride=layer.stride)
    if layer.lighting is None:
        return out
    return out + (light @ torch.from_numpy(layer.lighting))[:, :, None, None]


def _logistic_fit(X: Float, y: Float, start: Float) -> Float:
    """Return weights (k,) of inputs (n, k) for whether there is a ball (n,), near those at the start."""
    scale = X.std(axis=0)
    scale[scale == 0] = 1
    Z, near = X / scale, start * scale

    def loss(w: Float) -> tuple[float, Float]:
        log_odds = Z @ w
        chance = 1 / (1 + np.exp(-log_odds.clip(-50, 50)))
        value = _log_loss(log_odds, y) + RIDGE / 2 * float(np.sum((w - near) ** 2))
        return value, Z.T @ (chance - y) / len(y) + RIDGE * (w - near)

    return np.asarray(minimize(loss, near, jac=True, method="L-BFGS-B", options={"maxiter": 500}).x / scale)


def _errors(X: Float, y: Float, weights: Float) -> OddsErrors:
    log_odds = X @ weights
    return OddsErrors(_log_loss(log_odds, y), float(np.mean((log_odds > 0) == (y > 0))))


def _log_loss(log_odds: Float, y: Float) -> float:
    return float(np.mean(np.logaddexp(0, log_odds) - y * log_odds))
