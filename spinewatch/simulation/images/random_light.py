"""Random light: the cart's lamp, or lamps, those of the room, and what else is bright around the wound."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from spinewatch.arrays import Single
from spinewatch.simulation.images.draws import leaning, log_uniform, near, unit_vector
from spinewatch.simulation.images.world import Lamp, Surround

NO_SURROUND = Surround(0.0, 0.0)

_MOVED_RAD = 0.03
"""Standard deviation per axis of the lamps' directions within a view, in which they are not quite distant."""

_REGIMES = {"lamp": 0.3, "twin": 0.12, "mixed": 0.22, "overhead": 0.16, "side": 0.2}
_BY_CART = {
    "lamp": (0.9, 1.0),
    "twin": (0.4, 1.0),
    "mixed": (0.5, 0.9),
    "overhead": (0.03, 0.5),
    "side": (0.03, 0.7),
}
"""Fraction of worlds of each kind of light, and the share of the cart's lamps in it."""


@dataclass(frozen=True, eq=False)
class Light:
    """The light of a world.

    Attributes
    ----------
    lamps
        The lamps.
    lamp
        Unit vector to the cart's lamp or to the middle of its lamps, shape (3,).
    ambient
        Mean radiance of the room.
    glow
        Gradient of that radiance: it is ``1 + glow . d`` times the mean in direction d, shape (3,).
    surround
        Objects around the wound.
    """

    lamps: tuple[Lamp, ...]
    lamp: Single
    ambient: float
    glow: Single
    surround: Surround


def random_light(rng: np.random.Generator, up: Single) -> Light:
    """Return random light of about one unit of irradiance.

    The cart's lamp is near the middle between its cameras, or there is a ring of lamps about each camera; lamps of the
    room are anywhere above.

    Parameters
    ----------
    rng
        Source of random numbers.
    up
        Direction up in the room, where the cart's lamp is expected, shape (3,).

    Returns
    -------
    Light
        The light.
    """
    regime = str(rng.choice(list(_REGIMES), p=list(_REGIMES.values())))
    by_cart = rng.uniform(*_BY_CART[regime])
    rest = 1 - by_cart
    lamp = near(rng, up, 6 if rng.random() < 0.9 else 12)
    if regime == "twin":
        lamps = _twin_lamps(rng, lamp, by_cart)
    else:
        lamps = [Lamp(lamp, log_uniform(rng, 0.005, 0.12), by_cart, rng.random() < 0.5)]
    if regime == "side":
        lamps.append(
            Lamp(leaning(rng, up, 40, 85), log_uniform(rng, 0.02, 0.4), 0.9 * rest, rng.random() < 0.5)
        )
    else:
        lamps += _room_lamps(rng, up, 0.9 * rest)
    glow = leaning(rng, unit_vector(0, 0), 0, 90) * rng.uniform(0, 0.9)
    surround = NO_SURROUND
    if rng.random() < 0.5:
        surround = Surround(log_uniform(rng, 0.01, 0.2), rng.uniform(0.0, 0.8))
    return Light(tuple(lamps), lamp, log_uniform(rng, 0.01, 0.15) + 0.1 * rest, glow, surround)


def moved(rng: np.random.Generator, light: Light) -> Light:
    """Return the light at another place of a view: all lamps are rotated by the same small, random rotation.

    Parameters
    ----------
    rng
        Source of random numbers.
    light
        The light at one place.

    Returns
    -------
    Light
        The light at the other place.
    """
    rotation = rng.normal(0, _MOVED_RAD, 3)

    def rotated(direction: Single) -> Single:
        away = direction + np.cross(rotation, direction)
        return np.asarray(away / np.linalg.norm(away), dtype=np.float32)

    lamps = tuple(replace(lamp, direction=rotated(lamp.direction)) for lamp in light.lamps)
    return replace(light, lamps=lamps, lamp=rotated(light.lamp))


def _twin_lamps(rng: np.random.Generator, middle: Single, irradiance: float) -> list[Lamp]:
    """Return a ring of lamps about this camera, as one lamp, and one about the other camera."""
    here = near(rng, unit_vector(0, 0), 1.5)
    there = 2 * float(middle @ here) * middle - here
    radius, part = log_uniform(rng, 0.02, 0.12), rng.uniform(0.4, 0.6)
    is_disc = rng.random() < 0.7
    return [
        Lamp(here, radius, part * irradiance, is_disc),
        Lamp(there.astype(np.float32), radius, (1 - part) * irradiance, is_disc),
    ]


def _room_lamps(rng: np.random.Generator, up: Single, irradiance: float) -> list[Lamp]:
    """Return lamps anywhere above, or one lamp of several spots."""
    shares = irradiance * rng.dirichlet(np.ones(rng.integers(1, 6)))
    is_disc = rng.random() < 0.5
    if rng.random() < 0.3:
        middle = leaning(rng, up, 0, 55)
        radius = rng.uniform(0.01, 0.05)
        return [Lamp(near(rng, middle, 5), radius, float(share), is_disc) for share in shares]
    return [
        Lamp(leaning(rng, up, 0, 60), log_uniform(rng, 0.02, 0.5), float(share), is_disc) for share in shares
    ]
