"""Fitting of the odds of a ball to hard negatives.

A network fitted to places chosen at random states too high odds for the candidates of the detector, which are the
places of an image most like a ball. The weights of the log-odds in its last layer are fitted again, to examples whose
places without a ball a network takes for one. Its other outputs do not change.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from spinewatch.arrays import Float, Single
from spinewatch.detection.refinement.network_graph import NetworkGraph
from spinewatch.detection.refinement.networks import OUTPUTS, BallNetwork
from spinewatch.simulation.images.examples import Examples
from training.augmentation import augmented
from training.fit import BATCH
from training.others import SeenExamples

RIDGE = 1e-4
"""Weight of the squares of the changes of the weights, for inputs of unit standard deviation."""

HELD_OUT_FRACTION = 0.1
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
    hidden = _hidden(network, examples, seed)
    X = np.column_stack([hidden, np.ones(len(hidden))]).astype(np.float64)
    y = examples.ball.astype(np.float64)
    last = network.layers[-1]
    before = np.append(last.weights[0, 0, :, _LOG_ODDS], last.bias[_LOG_ODDS]).astype(np.float64)
    fitted = round((1 - HELD_OUT_FRACTION) * len(y))
    after = _logistic_fit(X[:fitted], y[:fitted], before)
    weights, bias = last.weights.copy(), last.bias.copy()
    weights[0, 0, :, _LOG_ODDS], bias[_LOG_ODDS] = after[:-1], after[-1]
    layers = (*network.layers[:-1], replace(last, weights=weights, bias=bias))
    errors_before, errors_after = (_errors(X[fitted:], y[fitted:], w) for w in (before, after))
    return replace(network, layers=layers), errors_before, errors_after


def _hidden(network: BallNetwork, examples: Examples, seed: int) -> Single:
    """Return the inputs (n, k) of a network's last layer for augmented examples."""
    torch.manual_seed(seed)
    rng = np.random.default_rng(seed)
    seen = SeenExamples.of(examples, network).some_known(rng)
    graph = NetworkGraph(network.layers[:-1], network.grid.size)
    parts = []
    for batch in torch.arange(len(examples.ball)).split(BATCH):
        images, light, _ = augmented(seen.images(batch), seen.truth[batch], examples.up[batch], rng)
        parts.append(graph(images.numpy(), light.numpy()))
    return np.maximum(np.concatenate(parts), 0)


def _logistic_fit(X: Float, y: Float, start: Float) -> Float:
    """Return weights (k,) of inputs (n, k) for whether there is a ball (n,), near those at the start."""
    scale = X.std(axis=0)
    scale[scale == 0] = 1
    Z, near, ball = (torch.from_numpy(values) for values in (X / scale, start * scale, y))
    w = near.clone().requires_grad_()
    optimizer = torch.optim.LBFGS([w], max_iter=500, line_search_fn="strong_wolfe")

    def loss() -> Tensor:
        optimizer.zero_grad()
        change = (w - near).square().sum()
        value = functional.binary_cross_entropy_with_logits(Z @ w, ball) + RIDGE / 2 * change
        value.backward()
        return value

    optimizer.step(loss)
    return np.asarray(w.detach().numpy() / scale)


def _errors(X: Float, y: Float, weights: Float) -> OddsErrors:
    log_odds = X @ weights
    log_loss = np.mean(np.logaddexp(0, log_odds) - y * log_odds)
    return OddsErrors(float(log_loss), float(np.mean((log_odds > 0) == (y > 0))))
