"""Shots of random worlds: a traced image about a place, and patches of it by the sensor of the view."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np

from spinewatch.arrays import Float, Int, Single
from spinewatch.detection.refinement.networks import MIN_CONTRAST, BallNetwork
from spinewatch.detection.refinement.patches import PatchGrid, cut_patches
from spinewatch.imaging.tone import patch_tone
from spinewatch.simulation.images.families import FAMILIES, families_of_sensor, families_of_world
from spinewatch.simulation.images.hard_negatives import hard_negative
from spinewatch.simulation.images.random_worlds import Setting, random_setting, random_world
from spinewatch.simulation.images.ray_tracing import trace
from spinewatch.simulation.images.sensor import SensorModel, expose, random_sensor
from spinewatch.simulation.images.world import World

_SIZE_SPREAD = 0.03
"""Standard deviation of the logarithm of the balls' size within a view."""
_HARD = 0.7
"""Fraction of the worlds without a ball whose patch is at a hard negative, if there is a network to find one."""
_MISPLACED = 0.08
"""Fraction of the worlds with a ball whose patch is not centred on it."""
_MAX_OFFSET = 0.5
"""Maximum distance of the patch's middle from the ball's centre, in radii, for the patch to show a ball."""
N_TRUTH = 10 + len(FAMILIES)
"""Numbers of the truth of a patch."""


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
    left_out
        Families of looks to which no example belongs.
    present
        Fraction of the worlds with a ball.
    hard_for
        Network for which most places without a ball are hard negatives; None for dark places and random ones.
    """

    grid: PatchGrid
    width_px: tuple[float, float]
    wider: float
    wider_share: float = 0.2
    samples: int = 28
    left_out: tuple[str, ...] = ()
    present: float = 0.72
    hard_for: BallNetwork | None = None


@dataclass(frozen=True, eq=False)
class View:
    """What the shots of one view share.

    Attributes
    ----------
    setting
        Light, tissue and materials.
    ball_px
        Width and height of a ball, shape (2,), px.
    sensors
        A sensor per exposure.
    """

    setting: Setting
    ball_px: Float
    sensors: tuple[SensorModel, ...]


def random_view(rng: np.random.Generator, textures: Single, exposures: int, p: ExampleParameters) -> View:
    """Return a random view, some of whose worlds belong to no family of looks that is left out.

    Parameters
    ----------
    rng
        Source of random numbers.
    textures
        Textures of the tissue, shape (m, n, n).
    exposures
        Number of exposures.
    p
        Properties of the examples.

    Returns
    -------
    View
        The view.
    """
    setting = _drawn(
        lambda: random_setting(rng, textures),
        lambda drawn: families_of_world(random_world(rng, textures, drawn, present=True)),
        p,
    )
    ball_px = _random_size(rng, p)
    size = (float(ball_px[0]), float(ball_px[1]))
    sensors = [_drawn(lambda: random_sensor(rng, size), families_of_sensor, p) for _ in range(exposures)]
    return View(setting, ball_px, tuple(sensors))


@dataclass(frozen=True, eq=False)
class Shot:
    """A traced image of a world, not exposed yet.

    Attributes
    ----------
    world
        The world.
    hard
        Whether the place is a hard negative.
    ball_px
        Width and height of a ball, shape (2,), px.
    half
        Pixels on each side of the middle one, along u and v, shape (2,).
    centre
        Centre of the ball's outline, or the place, shape (2,), px.
    samples
        Samples per pixel and axis.
    radiance
        Radiance of the samples, shape (h, w).
    visible
        Visible fraction of the ball's outline; 0 without one.
    """

    world: World
    hard: bool
    ball_px: Float
    half: Int
    centre: Float
    samples: int
    radiance: Single
    visible: float


def random_shot(rng: np.random.Generator, textures: Single, view: View, p: ExampleParameters) -> Shot:
    """Return a traced image of a random world of a view.

    Parameters
    ----------
    rng
        Source of random numbers.
    textures
        Textures of the tissue, shape (m, n, n).
    view
        The view.
    p
        Properties of the examples.

    Returns
    -------
    Shot
        The image.
    """
    present = bool(rng.random() < p.present)

    def draw_world() -> World:
        return _drawn(lambda: random_world(rng, textures, view.setting, present), families_of_world, p)

    network, place = p.hard_for, np.zeros(2)
    hard = network is not None and not present and bool(rng.random() < _HARD)
    ball_px = view.ball_px * np.exp(rng.normal(0, _SIZE_SPREAD))
    if network is not None and hard:
        world, place = hard_negative(network, ball_px, draw_world, view.sensors[0], rng)
    else:
        world = draw_world()
    half = np.ceil((p.grid.size / (2 * p.grid.radius) + 0.45) * ball_px / 2).astype(int) + 4
    # Most features are accurate to a fraction of a pixel, some are not.
    error = rng.normal(0, 0.05, 2) if rng.random() < 0.7 else rng.uniform(-0.4, 0.4, 2)
    centre = half + rng.uniform(-0.5, 0.5, 2) + error * ball_px / 2
    samples = max(1 if ball_px[0] < 14 else 2, round(p.samples / ball_px[0]))
    x, y = (
        (np.arange((2 * n + 1) * samples) + 0.5) / samples - 0.5 - c
        for n, c in zip(half, centre, strict=True)
    )
    x, y = x / (ball_px[0] / 2) + place[0], -y / (ball_px[1] / 2) + place[1]
    u, v = np.meshgrid(x.astype(np.float32), y.astype(np.float32))
    radiance, shown = trace(world, u, v, ground_step=min(samples, 2))
    visible = float(shown.sum() / (u * u + v * v < 1).sum()) if world.present else 0.0
    return Shot(world, hard, ball_px, half, centre, samples, radiance, visible)


def exposed(
    rng: np.random.Generator, shot: Shot, sensor: SensorModel, grid: PatchGrid
) -> tuple[Single, Single]:
    """Return the patch of a shot and its truth.

    Parameters
    ----------
    rng
        Source of random numbers.
    shot
        The shot.
    sensor
        The sensor.
    grid
        Samples of the patch.

    Returns
    -------
    patch : Single
        Log gray levels, shape (size, size).
    truth : Single
        Ball, offset (2), visible, log size, up (2), lamp (2), log height, families (k), shape (10 + k,), as the
        attributes of `Examples`.
    """
    world, ball_px, half, centre = shot.world, shot.ball_px, shot.half, shot.centre
    tone = patch_tone(expose(shot.radiance, shot.samples, sensor, rng))
    assumed = ball_px * np.exp(rng.normal(0, 0.03 if rng.random() < 0.5 else 0.1))
    middle = half
    if not world.present:
        middle = _darkest(tone, half, ball_px) if not shot.hard and rng.random() < 0.7 else half
    elif rng.random() < _MISPLACED:
        azimuth, distance = rng.uniform(0, 2 * np.pi), rng.uniform(0.6, 1.6)
        middle = np.rint(
            centre + np.array([np.cos(azimuth), np.sin(azimuth)]) * distance * ball_px / 2
        ).astype(int)
    patch = cut_patches(tone, middle[None], (float(assumed[0]), float(assumed[1])), grid)[0]
    offset = (centre - middle) / (assumed / 2)
    ball = world.present and np.hypot(*offset) < _MAX_OFFSET and patch.std() > MIN_CONTRAST
    log_size = np.log(ball_px[0] / assumed[0])
    directions = (d[:2] * (1, -1) for d in (world.up, world.lamp))
    families = families_of_world(world) | families_of_sensor(sensor)
    truth = [
        ball,
        *offset,
        shot.visible,
        log_size,
        *np.concatenate(list(directions)),
        np.log(world.ground.depth),
        *(families[name] for name in FAMILIES),
    ]
    return patch, np.array(truth, np.float32)


_Drawn = TypeVar("_Drawn")


def _drawn(
    draw: Callable[[], _Drawn], families: Callable[[_Drawn], Mapping[str, bool]], p: ExampleParameters
) -> _Drawn:
    """Return the first of what is drawn again and again that belongs to no family that is left out."""
    while True:
        drawn = draw()
        belongs = families(drawn)
        if not any(belongs.get(name, False) for name in p.left_out):
            return drawn


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
