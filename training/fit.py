"""Fitting of a ball network to examples.

The network estimates whether there is a ball, its centre with covariance, its visible fraction, its size, and the
direction of the lamp (`training.losses`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import torch

from spinewatch.detection.refinement.networks import BallNetwork
from spinewatch.simulation.images.examples import Examples
from spinewatch.simulation.images.families import FAMILIES
from training.augmentation import augmented, expected_light
from training.errors import FitErrors, fit_errors
from training.losses import batch_loss
from training.model import Architecture, ball_network, random_model
from training.others import SeenExamples

BATCH = 256
RATE = 2.5e-3
WEIGHT_DECAY = 1e-3
HELD_OUT_COUNT = 3000
"""Number of examples that are not trained on; the errors on them are printed."""


def fit(
    architecture: Architecture,
    examples: Examples,
    epochs: int,
    seed: int,
    left_out: Sequence[str] = (),
    on_epoch: Callable[[], None] = lambda: None,
) -> tuple[BallNetwork, FitErrors]:
    """Return a network fitted to all examples except the last `HELD_OUT_COUNT`, and its errors on these.

    One thread is used; several networks are fitted by several processes.

    Parameters
    ----------
    architecture
        Architecture of the network.
    examples
        Examples on the network's grid.
    epochs
        Number of passes over the examples.
    seed
        Seed of the initial weights, the order and the augmentation of the examples.
    left_out
        Families of looks whose examples are not trained on.
    on_epoch
        Called after each epoch.

    Returns
    -------
    network : BallNetwork
        The fitted network.
    errors : FitErrors
        Its errors on the held-out examples, by family of looks.
    """
    torch.set_num_threads(1)
    torch.manual_seed(seed)
    model = random_model(architecture)
    rng = np.random.default_rng(seed)
    all_known = SeenExamples.of(examples, architecture)
    held_out = len(examples.ball) - HELD_OUT_COUNT
    used = torch.arange(held_out)
    if left_out:
        families = examples.families[:held_out, [FAMILIES.index(name) for name in left_out]]
        used = used[torch.from_numpy(~families.any(axis=1))]
    batches = len(used) // BATCH
    optimizer = torch.optim.AdamW(model.parameters, lr=RATE, weight_decay=WEIGHT_DECAY)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, RATE, total_steps=epochs * batches)
    for _ in range(epochs):
        seen = all_known.some_known(rng)
        order = used[torch.randperm(len(used))]
        for batch in order[: batches * BATCH].split(BATCH):
            images, light, truth = augmented(seen.images(batch), seen.truth[batch], examples.up[batch], rng)
            optimizer.zero_grad()
            batch_loss(model(images, light), truth).backward()
            optimizer.step()
            schedule.step()
        on_epoch()
    with torch.no_grad():
        rest = torch.arange(held_out, len(examples.ball))
        outputs = model(all_known.images(rest), expected_light(examples.up[held_out:]))
        errors = fit_errors(outputs, all_known.truth[held_out:], examples.families[held_out:])
    return ball_network(architecture, model), errors
