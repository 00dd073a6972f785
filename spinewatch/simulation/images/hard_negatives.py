"""Places without a ball that a network takes for one: hard negatives.

Candidates of the detector are the places of an image most like a ball. Places chosen at random are not: networks fitted
to these alone state too high odds for candidates without a ball.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from spinewatch.arrays import Bool, Float
from spinewatch.detection.refinement.lighting import Lighting
from spinewatch.detection.refinement.networks import BallNetwork, predict_balls
from spinewatch.detection.refinement.patches import cut_patches
from spinewatch.imaging.tone import patch_tone
from spinewatch.simulation.images.ray_tracing import trace
from spinewatch.simulation.images.sensor import SensorModel, expose
from spinewatch.simulation.images.world import World

_TRIED = 4
"""Number of worlds of which the place with the highest odds is taken."""
_REACH, _STEP = 1.6, 0.4
"""Largest distance per axis of a place from the origin, and distance between neighbouring ones, radii."""
_APART = 1.2
"""Least distance of a place from balls, radii."""
_BALL_RADII = (0.55, 1.6)
"""Radii between which a sphere counts as a ball: the sizes that patches are cut for differ as much."""
_MARGIN = 0.3
"""Further radii about the patches."""

_AXIS = np.arange(-_REACH, _REACH + _STEP / 2, _STEP)
_PLACES = np.stack(np.meshgrid(_AXIS, _AXIS), axis=-1).reshape(-1, 2)
"""Places that are compared, x right and y up, shape (n, 2), radii."""


def hard_negative(
    network: BallNetwork,
    ball_px: Float,
    draw_world: Callable[[], World],
    sensor: SensorModel,
    rng: np.random.Generator,
) -> tuple[World, Float]:
    """Return a world and a place in it without a ball, for which a network states high odds.

    Parameters
    ----------
    network
        The network.
    ball_px
        Width and height of balls, shape (2,), px.
    draw_world
        Returns a random world without a ball at its origin.
    sensor
        Sensor of the image.
    rng
        Source of random numbers, for the noise.

    Returns
    -------
    world : World
        That of several with the highest odds; one ray per pixel is traced for the comparison.
    place : Float
        The place, x right and y up, shape (2,), radii.

    References
    ----------
    K.-K. Sung and T. Poggio, IEEE PAMI 20 (1998) 39, who train again with the negatives that deceived a classifier.

    Examples
    --------
    >>> from spinewatch.detection.refinement.network_file import default_networks
    >>> from spinewatch.simulation.images.random_worlds import random_setting, random_world
    >>> from spinewatch.simulation.images.sensor import random_sensor
    >>> from spinewatch.simulation.images.textures import random_textures
    >>> rng = np.random.default_rng(0)
    >>> textures = random_textures(rng, 2, 32)
    >>> setting, sensor = random_setting(rng, textures), random_sensor(rng, (9.0, 10.0))
    >>> draw_world = lambda: random_world(rng, textures, setting, present=False)
    >>> world, place = hard_negative(default_networks().proposal, np.array([9, 10]), draw_world, sensor, rng)
    >>> world.present, place.shape
    (False, (2,))
    """
    worlds = [draw_world() for _ in range(_TRIED)]
    log_odds = [
        np.where(_without_ball(world), _log_odds(network, world, ball_px, sensor, rng), -np.inf)
        for world in worlds
    ]
    best, place = np.unravel_index(np.argmax(log_odds), (len(worlds), len(_PLACES)))
    return worlds[best], _PLACES[place]


def _without_ball(world: World) -> Bool:
    """Return the mask (n,) of the places that are not near a ball of a world."""
    smallest, largest = _BALL_RADII
    balls = [sphere.centre[:2] for sphere in world.spheres if smallest < sphere.radius < largest]
    distance = np.linalg.norm(_PLACES[:, None] - np.reshape(balls, (-1, 2)), axis=2)
    return np.asarray(distance.min(axis=1, initial=np.inf) > _APART)


def _log_odds(
    network: BallNetwork, world: World, ball_px: Float, sensor: SensorModel, rng: np.random.Generator
) -> Float:
    """Return the log-odds (n,) of a ball at the places, in an image with one ray per pixel."""
    radii = network.grid.size / (2 * network.grid.radius) + _REACH + _MARGIN
    half = np.ceil(radii * ball_px / 2).astype(int)
    x, y = ((np.arange(2 * n + 1) - n) / (size / 2) for n, size in zip(half, ball_px, strict=True))
    u, v = np.meshgrid(x.astype(np.float32), -y.astype(np.float32))
    radiance, _ = trace(world, u, v)
    tone = patch_tone(expose(radiance, 1, sensor, rng))
    at = np.rint(half + _PLACES * (1, -1) * ball_px / 2).astype(np.intp)
    patches = cut_patches(tone, at, (float(ball_px[0]), float(ball_px[1])), network.grid)
    up = world.up[:2].astype(np.float64) * (1, -1)
    return predict_balls(network, patches, Lighting.expected(up)).log_odds
