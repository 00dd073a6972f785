"""Training examples: patches of simulated images, of a ball or of something else, with the truth."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Bool, Float, Int, Single
from spinewatch.detection.refinement.patches import PatchGrid, cut_patches
from spinewatch.imaging.tone import patch_tone
from spinewatch.simulation.images.random_worlds import random_world
from spinewatch.simulation.images.ray_tracing import trace
from spinewatch.simulation.images.sensor import expose, random_sensor
from spinewatch.simulation.images.textures import random_textures

_PRESENT = 0.75
"""Fraction of worlds with a ball."""
_MISPLACED = 0.08
"""Fraction of those whose patch is not centred on the ball."""
_MAX_OFFSET = 0.5
"""Maximum distance of the patch's middle from the ball's centre, in radii, for the patch to show a ball."""
_TEXTURES = 40
_TEXTURE_SIZE = 256
_TEXTURE_LIFE = 1000
"""Number of examples after which the textures are replaced."""


@dataclass(frozen=True)
class ExampleParameters:
    """Properties of the examples.

    Attributes
    ----------
    grid
        Sampling grid of the patches.
    width_px
        Minimum and maximum width of a ball, px.
    wider
        Maximum width of some of the balls, px.
    wider_share
        Fraction of the balls whose width reaches ``wider``.
    samples
        Minimum number of rays across a ball.
    """

    grid: PatchGrid
    width_px: tuple[float, float]
    wider: float
    wider_share: float = 0.2
    samples: int = 28


@dataclass(frozen=True, eq=False)
class Examples:
    """n examples.

    Attributes
    ----------
    patches
        Log gray levels as `cut_patches` samples them, shape (n, size, size).
    ball
        Whether there is a ball near the middle, shape (n,).
    offset
        Position of the ball's centre relative to the middle, u and v, shape (n, 2), in radii.
    visible
        Visible fraction of the ball, shape (n,).
    log_size
        Logarithm of the ratio of true to assumed size, shape (n,).
    up
        Expected direction of the cart's lamp: u and v components of a unit vector, shape (n, 2).
    lamp
        True direction of the cart's lamp, shape (n, 2).
    """

    patches: NDArray[np.float16]
    ball: Bool
    offset: Single
    visible: Single
    log_size: Single
    up: Single
    lamp: Single


def random_examples(rng: np.random.Generator, count: int, parameters: ExampleParameters) -> Examples:
    """Return examples of random worlds.

    Parameters
    ----------
    rng
        Source of random numbers.
    count
        Number of examples.
    parameters
        Their properties.

    Returns
    -------
    examples : Examples
        The examples; the same state of ``rng`` gives the same examples.

    Examples
    --------
    >>> parameters = ExampleParameters(PatchGrid(25, 5.0), (8.0, 12.0), wider=20.0)
    >>> random_examples(np.random.default_rng(0), 2, parameters).patches.shape
    (2, 25, 25)
    """
    patches = np.empty((count, parameters.grid.size, parameters.grid.size), np.float16)
    truth = np.empty((count, 9), np.float32)
    textures = random_textures(rng, _TEXTURES, _TEXTURE_SIZE)
    for i in range(count):
        if i and i % _TEXTURE_LIFE == 0:
            textures = random_textures(rng, _TEXTURES, _TEXTURE_SIZE)
        patches[i], truth[i] = _random_example(rng, textures, parameters)
    ball, offset, visible, log_size, up, lamp = np.split(truth, [1, 3, 4, 5, 7], axis=1)
    return Examples(patches, ball[:, 0] > 0, offset, visible[:, 0], log_size[:, 0], up, lamp)


def _random_example(
    rng: np.random.Generator, textures: Single, p: ExampleParameters
) -> tuple[Single, Single]:
    """Return a patch and its truth (9,): ball, offset, visible, log size, up, lamp."""
    world = random_world(rng, textures, present=bool(rng.random() < _PRESENT))
    ball_px = _random_size(rng, p)
    half = np.ceil((p.grid.size / (2 * p.grid.radius) + 0.45) * ball_px / 2).astype(int) + 3
    # Most features are accurate to a fraction of a pixel, some are not.
    error = rng.normal(0, 0.05, 2) if rng.random() < 0.7 else rng.uniform(-0.4, 0.4, 2)
    centre = half + rng.uniform(-0.5, 0.5, 2) + error * ball_px / 2
    samples = max(1 if ball_px[0] < 14 else 2, round(p.samples / ball_px[0]))
    x, y = (
        (np.arange((2 * n + 1) * samples) + 0.5) / samples - 0.5 - c
        for n, c in zip(half, centre, strict=True)
    )
    u, v = np.meshgrid((x / (ball_px[0] / 2)).astype(np.float32), (-y / (ball_px[1] / 2)).astype(np.float32))
    radiance, shown = trace(world, u, v)
    tone = patch_tone(expose(radiance, samples, random_sensor(rng), rng))
    visible = float(shown.sum() / (u * u + v * v < 1).sum()) if world.present else 0.0
    assumed = ball_px * np.exp(rng.normal(0, 0.03 if rng.random() < 0.5 else 0.1))
    middle = half
    if not world.present:
        middle = _darkest(tone, half, ball_px) if rng.random() < 0.7 else half
    elif rng.random() < _MISPLACED:
        azimuth, distance = rng.uniform(0, 2 * np.pi), rng.uniform(0.6, 1.6)
        middle = np.rint(
            centre + np.array([np.cos(azimuth), np.sin(azimuth)]) * distance * ball_px / 2
        ).astype(int)
    patch = cut_patches(tone, middle[None], (float(assumed[0]), float(assumed[1])), p.grid)[0]
    offset = (centre - middle) / (assumed / 2)
    ball = world.present and np.hypot(*offset) < _MAX_OFFSET
    log_size = np.log(ball_px[0] / assumed[0])
    directions = (d[:2] * (1, -1) for d in (world.up, world.lamps[0].direction))
    return patch, np.concatenate([[ball, *offset, visible, log_size], *directions]).astype(np.float32)


def _random_size(rng: np.random.Generator, p: ExampleParameters) -> Float:
    """Return a ball's (width, height), px; most pixels have the aspect ratio of the cart's."""
    low, high = p.width_px
    width = rng.uniform(low, high)
    if rng.random() < p.wider_share:
        width = np.exp(rng.uniform(np.log(low), np.log(p.wider)))
    return np.array([width, width / 0.845 if rng.random() < 0.6 else width * rng.uniform(0.85, 1.3)])


def _darkest(tone: Single, half: Int, ball_px: Float) -> Int:
    """Return the (u, v) of the darkest surroundings near the middle, which a detector may confuse with a ball."""
    smooth = cv2.GaussianBlur(tone, (0, 0), ball_px[0] / 5, sigmaY=ball_px[1] / 5)
    a, b = (0.8 * ball_px).astype(int)
    window = smooth[half[1] - b : half[1] + b + 1, half[0] - a : half[0] + a + 1]
    v, u = np.unravel_index(np.argmin(window), window.shape)
    return np.asarray(half + np.array([int(u) - a, int(v) - b]), dtype=np.intp)
