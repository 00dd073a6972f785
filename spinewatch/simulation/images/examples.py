"""Examples to learn from: patches of simulated pictures, about a ball or about something else, with the truth."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Single
from spinewatch.detection.refinement.patches import PatchGrid, cut_patches, patch_tone
from spinewatch.simulation.images.sensor import draw_sensor, expose
from spinewatch.simulation.images.trace import trace
from spinewatch.simulation.images.worlds import draw_textures, draw_world

_PRESENT = 0.75
_MISPLACED = 0.08
_OFF_CENTRE = 0.5
"""A patch whose middle is further than this from the ball's centre, in radii, is not one of a ball."""
_TEXTURES = 40
_TEXTURE_SIZE = 256
_RENEWED = 1000
"""Textures are drawn afresh after so many examples."""


@dataclass(frozen=True)
class ExampleParameters:
    """What the pictures are like: the patches' grid, and the range of a ball's width in pixels.

    ``wider``: a fraction ``wider_share`` of the balls is up to so wide. ``samples``: rays across a ball, at least.
    """

    grid: PatchGrid
    width_px: tuple[float, float]
    wider: float
    wider_share: float = 0.2
    samples: int = 28


@dataclass(frozen=True, eq=False)
class Examples:
    """n patches (n, size, size) of log gray levels as ``refine_centres`` cuts them, and what they show.

    ``ball`` (n,): is there one about the middle; ``offset`` (n, 2) of its centre from the middle in radii, u to the
    right and v down; ``visible`` fraction (n,); ``log_size`` (n,), logarithm of true over supposed size; ``up`` and
    ``lamp`` (n, 2), where the cart's lamp should hang and where it does: the u and v components of unit vectors.
    """

    patches: NDArray[np.float16]
    ball: NDArray[np.bool_]
    offset: Single
    visible: Single
    log_size: Single
    up: Single
    lamp: Single


def draw_examples(rng: np.random.Generator, count: int, parameters: ExampleParameters) -> Examples:
    """Return ``count`` examples of random worlds."""
    patches = np.empty((count, parameters.grid.size, parameters.grid.size), np.float16)
    truth = np.empty((count, 9), np.float32)
    textures = draw_textures(rng, _TEXTURES, _TEXTURE_SIZE)
    for i in range(count):
        if i and i % _RENEWED == 0:
            textures = draw_textures(rng, _TEXTURES, _TEXTURE_SIZE)
        patches[i], truth[i] = _draw_example(rng, textures, parameters)
    ball, offset, visible, log_size, up, lamp = np.split(truth, [1, 3, 4, 5, 7], axis=1)
    return Examples(patches, ball[:, 0] > 0, offset, visible[:, 0], log_size[:, 0], up, lamp)


def _draw_example(rng: np.random.Generator, textures: Single, p: ExampleParameters) -> tuple[Single, Single]:
    """Return a patch and the row of its truth: ball, offset, visible, log size, up, lamp."""
    world = draw_world(rng, textures, present=bool(rng.random() < _PRESENT))
    ball_px = _draw_size(rng, p)
    half = np.ceil((p.grid.size / (2 * p.grid.radius) + 0.45) * ball_px / 2).astype(int) + 3
    # Where the ball lies about the middle pixel: most features are good to a fraction of a pixel, some are not.
    spread = rng.normal(0, 0.05, 2) if rng.random() < 0.7 else rng.uniform(-0.4, 0.4, 2)
    centre = half + rng.uniform(-0.5, 0.5, 2) + spread * ball_px / 2
    fine = max(1 if ball_px[0] < 14 else 2, round(p.samples / ball_px[0]))
    x, y = ((np.arange((2 * n + 1) * fine) + 0.5) / fine - 0.5 - c for n, c in zip(half, centre, strict=True))
    u, v = np.meshgrid((x / (ball_px[0] / 2)).astype(np.float32), (-y / (ball_px[1] / 2)).astype(np.float32))
    radiance, seen = trace(world, u, v)
    tone = patch_tone(expose(radiance, fine, draw_sensor(rng), rng))
    visible = float(seen.sum() / (u * u + v * v < 1).sum()) if world.present else 0.0
    supposed = ball_px * np.exp(rng.normal(0, 0.03 if rng.random() < 0.5 else 0.1))
    middle = half
    if not world.present:
        middle = _darkest(tone, half, ball_px) if rng.random() < 0.7 else half
    elif rng.random() < _MISPLACED:
        turn, away = rng.uniform(0, 2 * np.pi), rng.uniform(0.6, 1.6)
        middle = np.rint(centre + np.array([np.cos(turn), np.sin(turn)]) * away * ball_px / 2).astype(int)
    patch = cut_patches(tone, middle[None], (float(supposed[0]), float(supposed[1])), p.grid)[0]
    offset = (centre - middle) / (supposed / 2)
    ball = world.present and np.hypot(*offset) < _OFF_CENTRE
    log_size = np.log(ball_px[0] / supposed[0])
    above = (d[:2] * (1, -1) for d in (world.up, world.lamps[0].direction))
    return patch, np.concatenate([[ball, *offset, visible, log_size], *above]).astype(np.float32)


def _draw_size(rng: np.random.Generator, p: ExampleParameters) -> NDArray[np.float64]:
    """Return a ball's (width, height) in pixels; most pixels are the cart's, a little wider than high."""
    low, high = p.width_px
    width = rng.uniform(low, high)
    if rng.random() < p.wider_share:
        width = np.exp(rng.uniform(np.log(low), np.log(p.wider)))
    return np.array([width, width / 0.845 if rng.random() < 0.6 else width * rng.uniform(0.85, 1.3)])


def _darkest(tone: Single, half: NDArray[np.intp], ball_px: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the pixel near the middle about which it is darkest: what a detector might take for a ball."""
    smooth = cv2.GaussianBlur(tone, (0, 0), ball_px[0] / 5, sigmaY=ball_px[1] / 5)
    a, b = (0.8 * ball_px).astype(int)
    window = smooth[half[1] - b : half[1] + b + 1, half[0] - a : half[0] + a + 1]
    v, u = np.unravel_index(np.argmin(window), window.shape)
    return np.asarray(half + np.array([int(u) - a, int(v) - b]), dtype=np.intp)
