"""The loss of a ball network: likelihoods of ball, centre and lamp, errors of visible fraction and size.

Centres and lamp are fitted by maximum likelihood of Student's t distribution with the estimated covariance, so that the
network learns its own uncertainty.

References
----------
A. Kendall and Y. Gal, What uncertainties do we need in Bayesian deep learning for computer vision?, NeurIPS 2017;
here with a heavier tail, for examples in which the ball cannot be located.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional

from spinewatch.detection.refinement.networks import OUTPUTS, SCALES
from training.augmentation import BALL, LAMP_U, LOG_HEIGHT, LOG_SIZE, VISIBLE, U, V

LAMP_WEIGHT = 0.3
LOG_ODDS_WEIGHT = 2
VISIBLE_WEIGHT = 0.5
SIZE_WEIGHT = 20
SIZE_BETA = 0.05
"""Error of the logarithm of the size at which its loss becomes linear."""


def batch_loss(outputs: Tensor, truth: Tensor) -> Tensor:
    """Return the loss of a batch: log-odds over all examples, everything else over those of balls.

    Parameters
    ----------
    outputs
        Outputs of the network, shape (n, k).
    truth
        Truth, shape (n, 8).

    Returns
    -------
    Tensor
        The loss, a scalar.
    """
    ball = truth[:, BALL] > 0.5
    estimated, true = by_name(outputs[ball]), truth[ball]
    centre = _student_loss(centre_chi2(estimated, true)) - estimated["log_u"] - estimated["log_v"]
    lamp = _student_loss(_lamp_chi2(estimated, true)) - 2 * estimated["log_lamp"]
    log_odds = functional.binary_cross_entropy_with_logits(
        outputs[:, OUTPUTS.index("log_odds")], truth[:, BALL]
    )
    visible = functional.mse_loss(torch.sigmoid(estimated["visible"]), true[:, VISIBLE])
    size = functional.smooth_l1_loss(
        SCALES.log_size * estimated["log_size"], true[:, LOG_SIZE], beta=SIZE_BETA
    )
    return (
        centre.mean()
        + LAMP_WEIGHT * lamp.mean()
        + LOG_ODDS_WEIGHT * log_odds
        + VISIBLE_WEIGHT * visible
        + SIZE_WEIGHT * size
    )


def by_name(outputs: Tensor) -> dict[str, Tensor]:
    """Return outputs by name.

    Parameters
    ----------
    outputs
        Outputs of the network, shape (n, k).

    Returns
    -------
    dict
        Columns, shape (n,).
    """
    return {name: outputs[:, i] for i, name in enumerate(OUTPUTS)}


def _student_loss(chi2: Tensor) -> Tensor:
    """Return the negative log-likelihood (n,) of errors in two dimensions, without the term of the covariance."""
    return (SCALES.dof + 2) / 2 * torch.log1p(chi2 / SCALES.dof)


def centre_chi2(estimated: dict[str, Tensor], true: Tensor) -> Tensor:
    """Return the squared errors of centres with respect to their estimated covariance.

    Parameters
    ----------
    estimated
        Outputs by name, each of shape (n,).
    true
        Truth, shape (n, 8).

    Returns
    -------
    Tensor
        Squared errors, shape (n,), in the scale of Student's t distribution.
    """
    du = true[:, U] - SCALES.offset * estimated["u"]
    dv = true[:, V] - SCALES.offset * estimated["v"]
    a, b = (torch.exp(estimated[name] + SCALES.log_precision) for name in ("log_u", "log_v"))
    return (a * du + estimated["off_diagonal"] * b * dv) ** 2 + (b * dv) ** 2


def _lamp_chi2(estimated: dict[str, Tensor], true: Tensor) -> Tensor:
    """Return the squared errors (n,) of lamp directions over their estimated variance."""
    direction = torch.stack([estimated["lamp_u"], estimated["lamp_v"]], dim=1)
    squared = (true[:, LAMP_U:LOG_HEIGHT] - SCALES.lamp * direction).square().sum(dim=1)
    return squared * torch.exp(2 * estimated["log_lamp"] + 2 * SCALES.log_lamp)
