"""Examples as tensors, and their augmentation: random errors of the light's inputs, mirrored and transposed patches.

What the networks see of the other balls is in ``training.others``.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor

from spinewatch.arrays import Float, Single
from spinewatch.detection.refinement.lighting import lighting_inputs
from spinewatch.detection.refinement.networks import normalize
from spinewatch.simulation.images.examples import Examples

EXPECTED_LAMP_SD, MEASURED_LAMP_SD = 0.04, (0.015, 0.06)
"""Errors of the lamp input per axis, on the unit sphere: of the expected direction, and the limits between which those
of a measured one vary, which is poor where balls have no highlight."""
MEASURED_LAMP_SHARE, MEASURED_HEIGHT_SHARE = 0.6, 0.7
"""Fraction of the examples whose lamp input is the measured direction, and fraction of those whose height is given."""
MEASURED_HEIGHT_SD = (0.1, 0.5)
"""Limits between which the errors of the logarithm of that height vary."""

BALL, U, V, VISIBLE, LOG_SIZE, LAMP_U, LAMP_V, LOG_HEIGHT = range(8)
"""Columns of the truth: ball or not, centre in radii, visible fraction, logarithm of the size, lamp direction,
logarithm of the height over the tissue."""
_TRUTH = ("ball", "offset", "visible", "log_size", "lamp", "log_height")
"""Attributes of the examples that these are."""
LIGHT_U, LIGHT_V, SHADOW_U, SHADOW_V = 0, 1, 4, 5
"""Columns of the inputs of the light that have a direction."""


def as_tensors(examples: Examples) -> tuple[Tensor, Tensor]:
    """Return examples as the networks are fitted to them.

    Parameters
    ----------
    examples
        n examples.

    Returns
    -------
    patches : Tensor
        Normalized patches, shape (n, size, size).
    truth : Tensor
        Their truth, shape (n, 8), in columns from `BALL` to `LOG_HEIGHT`.
    """
    patches = torch.from_numpy(normalize(examples.patches.astype(np.float32)))
    columns = [getattr(examples, name) for name in _TRUTH]
    return patches, torch.from_numpy(np.column_stack(columns).astype(np.float32))


def augmented(
    patches: Tensor, truth: Tensor, up: Single, rng: np.random.Generator
) -> tuple[Tensor, Tensor, Tensor]:
    """Return a batch with random errors of the light's inputs, mirrored and transposed at random.

    Parameters
    ----------
    patches
        Images of each patch, shape (n, channels in, size, size).
    truth
        Their truth, shape (n, 8).
    up
        Expected directions of the lamp, shape (n, 2).
    rng
        Source of random numbers for the inputs of the light; the others are PyTorch's.

    Returns
    -------
    patches, light, truth : Tensor
        The batch, with the inputs (n, 7) of the light.
    """
    light = _light(rng, up, truth.numpy())
    mirror_u, mirror_v, transpose = (torch.rand(3) < 0.5).tolist()
    return turned(patches, light, truth, mirror_u=mirror_u, mirror_v=mirror_v, transpose=transpose)


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
    """Return numbers (n,) whose logarithms are uniform between limits."""
    low, high = np.log(limits)
    return np.asarray(np.exp(low + (high - low) * rng.random(n)))


def expected_light(up: Single) -> Tensor:
    """Return the inputs of the light when it is not measured.

    Parameters
    ----------
    up
        Expected directions of the lamp, shape (n, 2).

    Returns
    -------
    Tensor
        Inputs of the light, shape (n, 7).
    """
    n = len(up)
    unknown = np.zeros(n, dtype=bool)
    return torch.from_numpy(lighting_inputs(up.astype(float), unknown, np.zeros(n), unknown))


def turned(
    patches: Tensor, light: Tensor, truth: Tensor, *, mirror_u: bool, mirror_v: bool, transpose: bool
) -> tuple[Tensor, Tensor, Tensor]:
    """Return a batch that is mirrored and transposed, so that light comes from all sides.

    Parameters
    ----------
    patches
        Images of each patch, shape (n, channels in, size, size).
    light
        Inputs of the light, shape (n, 7).
    truth
        Truth, shape (n, 8).
    mirror_u, mirror_v
        Whether columns, and rows, are reversed.
    transpose
        Whether rows and columns are exchanged afterwards.

    Returns
    -------
    patches, light, truth : Tensor
        The batch; what has a direction is turned with the patches.
    """
    light, truth = light.clone(), truth.clone()
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
