"""Training examples: patches of simulated images, of a ball or of something else, with the truth."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Bool, Float, Int, Single
from spinewatch.detection.refinement.networks import MIN_CONTRAST, BallNetwork
from spinewatch.detection.refinement.patches import PatchGrid, cut_patches
from spinewatch.imaging.tone import patch_tone
from spinewatch.simulation.images.hard_negatives import hard_negative
from spinewatch.simulation.images.random_worlds import random_world
from spinewatch.simulation.images.ray_tracing import trace
from spinewatch.simulation.images.sensor import SensorModel, expose, random_sensor
from spinewatch.simulation.images.textures import random_textures
from spinewatch.simulation.images.world import World

FAMILIES = (
    "glossy",
    "satin",
    "matte",
    "smeared",
    "dark tissue",
    "side lamp",
    "twin lamps",
    "defocused",
    "shaken",
    "compressed",
    "sharpened",
    "noisy",
)
"""Families of looks for which errors are reported; an example belongs to several, or to none."""
UNUSUAL = tuple(family for family in FAMILIES if family != "glossy")
"""Families of unusual looks; the others show glossy balls in clean and sharp images."""
_SATIN, _MATTE = 0.14, 0.35
"""Roughness from which a ball is satin, and from which it is matte."""
_DARK = 0.05
"""Albedo below which tissue is dark."""
_RAKING = 0.75
"""Lamps are at the side where the cosine of their angle to the viewing direction is smaller."""
_NOISY = 1.6
"""Read noise above which an image is noisy, gray levels."""
_STRONG = 0.3
"""Least irradiance of such a lamp."""

_EXPOSURES = 2
"""Examples of each world, by different sensors."""
_HARD = 0.7
"""Fraction of the worlds without a ball whose patch is at a hard negative, if there is a network to find one."""
_MISPLACED = 0.08
"""Fraction of the worlds with a ball whose patch is not centred on it."""
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
        True direction of the cart's lamp or of the middle of its lamps, shape (n, 2).
    log_height
        Logarithm of the height, in radii, of the ball's centre over the tissue, shape (n,).
    families
        Whether an example belongs to each of the `FAMILIES`, shape (n, k).
    """

    patches: NDArray[np.float16]
    ball: Bool
    offset: Single
    visible: Single
    log_size: Single
    up: Single
    lamp: Single
    log_height: Single
    families: Bool

    @classmethod
    def concatenate(cls, parts: Sequence[Examples]) -> Examples:
        """Return the examples of several parts, in order.

        Parameters
        ----------
        parts
            The parts, at least one.

        Returns
        -------
        examples : Examples
            All examples.
        """
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])))

    def take(self, index: Int | Bool) -> Examples:
        """Return a selection of the examples.

        Parameters
        ----------
        index
            Index or mask array.

        Returns
        -------
        examples : Examples
            The selected examples, in the order of the index.
        """
        return Examples(*(values[index] for values in vars(self).values()))

    def without(self, families: Sequence[str]) -> Examples:
        """Return the examples that belong to none of some families of looks.

        Parameters
        ----------
        families
            Names of families.

        Returns
        -------
        examples : Examples
            The other examples.
        """
        belongs = self.families[:, [FAMILIES.index(name) for name in families]]
        return self.take(np.flatnonzero(~belongs.any(axis=1)))


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
    truth = np.empty((count, 10 + len(FAMILIES)), np.float32)
    textures = random_textures(rng, _TEXTURES, _TEXTURE_SIZE)
    for i in range(count):
        if i and i % _TEXTURE_LIFE == 0:
            textures = random_textures(rng, _TEXTURES, _TEXTURE_SIZE)
        if i % _EXPOSURES == 0:
            shot = _random_shot(rng, textures, parameters)
        patches[i], truth[i] = _exposed(rng, shot, parameters)
    ball, offset, visible, log_size, up, lamp, log_height, families = np.split(
        truth, [1, 3, 4, 5, 7, 9, 10], axis=1
    )
    return Examples(
        patches,
        ball[:, 0] > 0,
        offset,
        visible[:, 0],
        log_size[:, 0],
        up,
        lamp,
        log_height[:, 0],
        families > 0,
    )


@dataclass(frozen=True, eq=False)
class _Shot:
    """A traced image of a world, not exposed yet: of `half` px about a pixel on each side, and its ball's centre."""

    world: World
    hard: bool
    ball_px: Float
    half: Int
    centre: Float
    samples: int
    radiance: Single
    visible: float


def _random_shot(rng: np.random.Generator, textures: Single, p: ExampleParameters) -> _Shot:
    """Return an image of a random world."""
    present = bool(rng.random() < p.present)

    def draw_world() -> World:
        return _drawn(lambda: random_world(rng, textures, present), _families_of_world, p)

    network, place = p.hard_for, np.zeros(2)
    hard = network is not None and not present and bool(rng.random() < _HARD)
    if network is not None and hard:
        ball_px = _random_size(rng, p)
        world, place = hard_negative(
            network, ball_px, draw_world, lambda: _random_sensor(rng, ball_px, p), rng
        )
    else:
        world, ball_px = draw_world(), _random_size(rng, p)
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
    return _Shot(world, hard, ball_px, half, centre, samples, radiance, visible)


def _exposed(rng: np.random.Generator, shot: _Shot, p: ExampleParameters) -> tuple[Single, Single]:
    """Return a patch and its truth (10 + k,): ball, offset, visible, log size, up, lamp, log height, families."""
    world, ball_px, half, centre = shot.world, shot.ball_px, shot.half, shot.centre
    sensor = _random_sensor(rng, ball_px, p)
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
    patch = cut_patches(tone, middle[None], (float(assumed[0]), float(assumed[1])), p.grid)[0]
    offset = (centre - middle) / (assumed / 2)
    ball = world.present and np.hypot(*offset) < _MAX_OFFSET and patch.std() > MIN_CONTRAST
    log_size = np.log(ball_px[0] / assumed[0])
    directions = (d[:2] * (1, -1) for d in (world.up, world.lamp))
    families = _families_of_world(world) | _families_of_sensor(sensor)
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


def _random_sensor(rng: np.random.Generator, ball_px: Float, p: ExampleParameters) -> SensorModel:
    size = (float(ball_px[0]), float(ball_px[1]))
    return _drawn(lambda: random_sensor(rng, size), _families_of_sensor, p)


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


def _families_of_world(world: World) -> dict[str, bool]:
    """Return whether images of a world belong to each of the families that depend on it."""
    ball = world.spheres[0] if world.present else None
    roughness = ball.material.roughness if ball else np.nan
    return {
        "glossy": roughness < _SATIN,
        "satin": _SATIN <= roughness < _MATTE,
        "matte": roughness >= _MATTE,
        "smeared": ball is not None and ball.smear is not None,
        "dark tissue": world.ground.albedo < _DARK,
        "side lamp": any(lamp.direction[2] < _RAKING and lamp.irradiance > _STRONG for lamp in world.lamps),
        "twin lamps": len(world.lamps) > 1 and world.lamps[0].direction is not world.lamp,
    }


def _families_of_sensor(sensor: SensorModel) -> dict[str, bool]:
    """Return whether images of a sensor belong to each of the families that depend on it."""
    return {
        "defocused": max(sensor.defocus_px) > 0,
        "shaken": max(np.abs(sensor.motion_px)) > 0,
        "compressed": sensor.quality is not None,
        "sharpened": sensor.sharpening > 0,
        "noisy": sensor.read > _NOISY,
    }


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
