"""Fitting of a ball network to examples.

The network estimates whether there is a ball, its centre with covariance, its visible fraction, its size, and the
direction of the lamp. Centres and lamp are fitted by maximum likelihood of Student's t distribution with the estimated
covariance, so that the network learns its own uncertainty.

References
----------
A. Kendall and Y. Gal, What uncertainties do we need in Bayesian deep learning for computer vision?, NeurIPS 2017;
here with a heavier tail, for examples in which the ball cannot be located.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from spinewatch.arrays import Bool, Float, Single
from spinewatch.detection.refinement.lighting import N_INPUTS, lighting_inputs
from spinewatch.detection.refinement.network_graph import Layer
from spinewatch.detection.refinement.networks import OUTPUTS, SCALES, BallNetwork, normalize
from spinewatch.detection.refinement.patches import PatchGrid
from spinewatch.simulation.images.examples import FAMILIES, Examples

BATCH = 256
RATE = 2.5e-3
WEIGHT_DECAY = 1e-3
REGION_95 = 5.99
"""Chi-square of two degrees of freedom that 95% of errors do not exceed, if they are normal."""
HELD_OUT = 3000
"""Number of examples that are not trained on; the errors on them are printed."""
EXPECTED_LAMP_SD, MEASURED_LAMP_SD = 0.04, (0.015, 0.06)
"""Errors of the lamp input per axis, on the unit sphere: of the expected direction, and the limits between which those
of a measured one vary, which is poor where balls have no highlight."""
MEASURED_LAMP_SHARE, MEASURED_HEIGHT_SHARE = 0.6, 0.7
"""Fraction of the examples whose lamp input is the measured direction, and fraction of those whose height is given."""
MEASURED_HEIGHT_SD = (0.1, 0.5)
"""Limits between which the errors of the logarithm of that height vary."""

LAMP_WEIGHT = 0.3
LOG_ODDS_WEIGHT = 2
VISIBLE_WEIGHT = 0.5
SIZE_WEIGHT = 20
SIZE_BETA = 0.05
"""Error of the logarithm of the size at which its loss becomes linear."""

BALL, U, V, VISIBLE, LOG_SIZE, LAMP_U, LAMP_V, LOG_HEIGHT = range(8)
"""Columns of the truth: ball or not, centre in radii, visible fraction, logarithm of the size, lamp direction,
logarithm of the height over the tissue."""
_TRUTH = ("ball", "offset", "visible", "log_size", "lamp", "log_height")
"""Attributes of the examples that these are."""
LIGHT_U, LIGHT_V, SHADOW_U, SHADOW_V = 0, 1, 4, 5
"""Columns of the inputs of the light that have a direction."""


@dataclass(frozen=True)
class Architecture:
    """The architecture of a network.

    Attributes
    ----------
    grid
        Samples of its patches.
    min_width_px
        Least width of balls that it is for, px.
    convolutions
        (size, stride, channels) of each convolution.
    hidden
        Units of each of the two hidden layers.
    """

    grid: PatchGrid
    min_width_px: float
    convolutions: tuple[tuple[int, int, int], ...]
    hidden: int


@dataclass(frozen=True, eq=False)
class _Model:
    """The layers; the light is added at the first hidden one."""

    convolutions: nn.Sequential
    first: nn.Linear
    lighting: nn.Linear
    second: nn.Linear
    last: nn.Linear

    @property
    def parameters(self) -> list[Tensor]:
        parts = (self.convolutions, self.first, self.lighting, self.second, self.last)
        return [parameter for part in parts for parameter in part.parameters()]

    def __call__(self, patches: Tensor, lighting: Tensor) -> Tensor:
        """Return the outputs (n, k) of patches (n, 1, size, size) with the inputs (n, 7) of the light."""
        in_order = patches.contiguous(memory_format=torch.channels_last)
        hidden = torch.relu(self.first(self.convolutions(in_order).flatten(1)) + self.lighting(lighting))
        return self.last(torch.relu(self.second(hidden)))


@dataclass(frozen=True)
class CentreErrors:
    """Errors of the centres of balls in full view, and how they compare with their stated covariances.

    Attributes
    ----------
    balls
        Number of balls.
    found
        Fraction that the network recognizes.
    median_radii
        Median absolute error per axis, radii.
    rms_radii
        RMS error per axis, radii.
    chi2_per_dof
        Mean chi-square per degree of freedom.
    within_95
        Fraction inside the 95% regions.
    """

    balls: int
    found: float
    median_radii: float
    rms_radii: float
    chi2_per_dof: float
    within_95: float

    def __str__(self) -> str:
        return (
            f"{self.balls:5} balls, found {self.found:6.1%}, median error {self.median_radii:.4f} radii, "
            f"RMS {self.rms_radii:.4f}, chi2 / dof {self.chi2_per_dof:.2f}, "
            f"in the 95% region {self.within_95:.1%}"
        )


@dataclass(frozen=True)
class FitErrors:
    """Errors of a network on the held-out examples.

    Attributes
    ----------
    classified
        Fraction of all held-out examples that are classified correctly, the lamp not measured.
    families
        Errors of all of them ("all") and of each family of looks that has any.
    """

    classified: float
    families: dict[str, CentreErrors]

    def __str__(self) -> str:
        lines = [f"held out, lamp not measured: classified correctly {self.classified:.1%}"]
        return "\n".join([*lines, *(f"  {name:13} {errors}" for name, errors in self.families.items())])


def fit(
    architecture: Architecture,
    examples: Examples,
    epochs: int,
    seed: int,
    left_out: Sequence[str] = (),
    on_epoch: Callable[[], None] = lambda: None,
) -> tuple[BallNetwork, FitErrors]:
    """Return a network fitted to all examples except the last `HELD_OUT`, and its errors on these.

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
    model = _model(architecture)
    rng = np.random.default_rng(seed)
    patches, truth = as_tensors(examples)
    held_out = len(patches) - HELD_OUT
    used = torch.arange(held_out)
    if left_out:
        families = examples.families[:held_out, [FAMILIES.index(name) for name in left_out]]
        used = used[torch.from_numpy(~families.any(axis=1))]
    batches = len(used) // BATCH
    optimizer = torch.optim.AdamW(model.parameters, lr=RATE, weight_decay=WEIGHT_DECAY)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, RATE, total_steps=epochs * batches)
    for _ in range(epochs):
        order = used[torch.randperm(len(used))]
        for batch in order[: batches * BATCH].split(BATCH):
            some_patches, some_light, some_truth = augmented(
                patches[batch], truth[batch], examples.up[batch], rng
            )
            optimizer.zero_grad()
            _loss(model(some_patches, some_light), some_truth).backward()
            optimizer.step()
            schedule.step()
        on_epoch()
    with torch.no_grad():
        outputs = model(patches[held_out:], _expected_light(examples.up[held_out:]))
        errors = _errors(outputs, truth[held_out:], examples.families[held_out:])
    return _exported(architecture, model), errors


def _model(architecture: Architecture) -> _Model:
    """Return a model with random weights."""
    steps: list[nn.Module] = []
    size, channels = architecture.grid.size, 1
    for kernel, stride, out in architecture.convolutions:
        steps += [nn.Conv2d(channels, out, kernel, stride), nn.ReLU()]
        size, channels = (size - kernel) // stride + 1, out
    hidden = architecture.hidden
    return _Model(
        nn.Sequential(*steps).to(memory_format=torch.channels_last),
        nn.Linear(channels * size * size, hidden),
        nn.Linear(N_INPUTS, hidden, bias=False),
        nn.Linear(hidden, hidden),
        nn.Linear(hidden, len(OUTPUTS)),
    )


def as_tensors(examples: Examples) -> tuple[Tensor, Tensor]:
    """Return the normalized patches (n, 1, size, size) of examples, and their truth (n, 9)."""
    patches = torch.from_numpy(normalize(examples.patches.astype(np.float32)))[:, None]
    columns = [getattr(examples, name) for name in _TRUTH]
    return patches, torch.from_numpy(np.column_stack(columns).astype(np.float32))


def augmented(
    patches: Tensor, truth: Tensor, up: Single, rng: np.random.Generator
) -> tuple[Tensor, Tensor, Tensor]:
    """Return a batch with random errors of the light's inputs, mirrored and transposed at random.

    Parameters
    ----------
    patches
        Normalized patches, shape (n, 1, size, size).
    truth
        Their truth, shape (n, 9).
    up
        Expected directions of the lamp, shape (n, 2).
    rng
        Source of random numbers for the inputs of the light; the others are PyTorch's.

    Returns
    -------
    patches, light, truth : Tensor
        The batch, with the inputs (n, 7) of the light.
    """
    return _turned(patches, _light(rng, up, truth.numpy()), truth)


def _light(rng: np.random.Generator, up: Single, truth: Single) -> Tensor:
    """Return inputs of the light (n, 7): of some examples measured ones, of others the expected direction alone."""
    n = len(up)
    lamp_is_measured = rng.random(n) < MEASURED_LAMP_SHARE
    height_is_measured = lamp_is_measured & (rng.random(n) < MEASURED_HEIGHT_SHARE)
    expectation = up + EXPECTED_LAMP_SD * rng.standard_normal((n, 2))
    sd = _log_uniform(rng, MEASURED_LAMP_SD, n)
    measurement = truth[:, [LAMP_U, LAMP_V]] + sd[:, None] * rng.standard_normal((n, 2))
    lamp = np.where(lamp_is_measured[:, None], measurement, expectation)
    height_sd = _log_uniform(rng, MEASURED_HEIGHT_SD, n)
    log_height = truth[:, LOG_HEIGHT] + height_sd * rng.standard_normal(n)
    return torch.from_numpy(lighting_inputs(lamp, lamp_is_measured, log_height, height_is_measured))


def _log_uniform(rng: np.random.Generator, limits: tuple[float, float], n: int) -> Float:
    low, high = np.log(limits)
    return np.asarray(np.exp(low + (high - low) * rng.random(n)))


def _expected_light(up: Single) -> Tensor:
    """Return the inputs of the light (n, 7) of expected directions (n, 2)."""
    n = len(up)
    unknown = np.zeros(n, dtype=bool)
    return torch.from_numpy(lighting_inputs(up.astype(float), unknown, np.zeros(n), unknown))


def _turned(patches: Tensor, light: Tensor, truth: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Return a batch that is mirrored and transposed at random, so that light comes from all sides."""
    light, truth = light.clone(), truth.clone()
    mirror_u, mirror_v, transpose = (torch.rand(3) < 0.5).tolist()
    if mirror_u:
        patches = patches.flip(-1)
        light[:, [LIGHT_U, SHADOW_U]] *= -1
        truth[:, [U, LAMP_U]] *= -1
    if mirror_v:
        patches = patches.flip(-2)
        light[:, [LIGHT_V, SHADOW_V]] *= -1
        truth[:, [V, LAMP_V]] *= -1
    if transpose:
        patches = patches.transpose(-1, -2)
        light[:, [LIGHT_U, LIGHT_V, SHADOW_U, SHADOW_V]] = light[:, [LIGHT_V, LIGHT_U, SHADOW_V, SHADOW_U]]
        truth[:, [U, V, LAMP_U, LAMP_V]] = truth[:, [V, U, LAMP_V, LAMP_U]]
    return patches, light, truth


def _loss(outputs: Tensor, truth: Tensor) -> Tensor:
    """Return the loss of a batch: log-odds over all examples, everything else over those of balls."""
    ball = truth[:, BALL] > 0.5
    estimated, true = _by_name(outputs[ball]), truth[ball]
    centre = _student_loss(_centre_chi2(estimated, true)) - estimated["log_u"] - estimated["log_v"]
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


def _by_name(outputs: Tensor) -> dict[str, Tensor]:
    """Return the columns (n,) of outputs (n, k) by name."""
    return {name: outputs[:, i] for i, name in enumerate(OUTPUTS)}


def _student_loss(chi2: Tensor) -> Tensor:
    """Return the negative log-likelihood (n,) of errors in two dimensions, without the term of the covariance."""
    return (SCALES.dof + 2) / 2 * torch.log1p(chi2 / SCALES.dof)


def _centre_chi2(estimated: dict[str, Tensor], true: Tensor) -> Tensor:
    """Return the squared errors (n,) of centres with respect to their estimated covariance."""
    du = true[:, U] - SCALES.offset * estimated["u"]
    dv = true[:, V] - SCALES.offset * estimated["v"]
    a, b = (torch.exp(estimated[name] + SCALES.log_precision) for name in ("log_u", "log_v"))
    return (a * du + estimated["off_diagonal"] * b * dv) ** 2 + (b * dv) ** 2


def _lamp_chi2(estimated: dict[str, Tensor], true: Tensor) -> Tensor:
    """Return the squared errors (n,) of lamp directions over their estimated variance."""
    direction = torch.stack([estimated["lamp_u"], estimated["lamp_v"]], dim=1)
    squared = (true[:, LAMP_U:LOG_HEIGHT] - SCALES.lamp * direction).square().sum(dim=1)
    return squared * torch.exp(2 * estimated["log_lamp"] + 2 * SCALES.log_lamp)


def _errors(outputs: Tensor, truth: Tensor, families: Bool) -> FitErrors:
    """Return the errors of outputs (n, k) of all examples and of each family."""
    clear = (truth[:, BALL] > 0.5) & (truth[:, VISIBLE] > 0.9)
    correct = ((outputs[:, OUTPUTS.index("log_odds")] > 0) == (truth[:, BALL] > 0.5)).float().mean()
    masks = {"all": np.ones(len(truth), dtype=bool)} | dict(zip(FAMILIES, families.T, strict=True))
    chosen = {name: clear & torch.from_numpy(mask) for name, mask in masks.items()}
    return FitErrors(
        float(correct),
        {name: _centre_errors(outputs[mask], truth[mask]) for name, mask in chosen.items() if mask.any()},
    )


def _centre_errors(outputs: Tensor, truth: Tensor) -> CentreErrors:
    """Return the errors of the centres of n balls."""
    estimated = _by_name(outputs)
    offset = torch.stack([estimated["u"], estimated["v"]], dim=1)
    error = (truth[:, U:VISIBLE] - SCALES.offset * offset).abs()
    chi2 = _centre_chi2(estimated, truth) * (SCALES.dof - 2) / SCALES.dof
    return CentreErrors(
        len(truth),
        float((estimated["log_odds"] > 0).float().mean()),
        float(error.median()),
        float(error.square().mean().sqrt()),
        float(chi2.mean() / 2),
        float((chi2 < REGION_95).float().mean()),
    )


def _exported(architecture: Architecture, model: _Model) -> BallNetwork:
    """Return the fitted model as the library evaluates it."""
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
    return np.asarray(values.detach().numpy(), dtype=np.float32)
