"""Random worlds for training images.

Properties that differ between operating rooms have wide distributions: positions of the lamps, roughness of the tissue,
gloss of the balls.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from spinewatch.arrays import Floating, Single
from spinewatch.simulation.images.world import Cylinder, Ground, Lamp, Material, Sphere, Surround, World

_BENCH = 0.06
"""Fraction of worlds that are a bench on which the cart is tested instead of an operating room."""

_NO_SURROUND = Surround(0.0, 0.0)


def random_world(rng: np.random.Generator, textures: Single, present: bool) -> World:
    """Return a random world with, or without, a ball at its origin.

    Parameters
    ----------
    rng
        Source of random numbers.
    textures
        Textures of the tissue from `random_textures`, shape (m, n, n).
    present
        Whether there is a ball at the origin.

    Returns
    -------
    World
        The world.

    Examples
    --------
    >>> from spinewatch.simulation.images.textures import random_textures
    >>> rng = np.random.default_rng(0)
    >>> world = random_world(rng, random_textures(rng, 2, 32), present=True)
    >>> world.spheres[0].radius
    1.0
    """
    up = _random_up(rng)
    ground = _random_ground(rng, textures, up)
    lamps, ambient = _random_light(rng, up)
    surround = _random_surround(rng)
    if rng.random() < _BENCH:
        ground, lamps, ambient = _random_bench(rng, ground, lamps)
        surround = _NO_SURROUND
    spheres, cylinders = [], []
    black = Material(
        _log_uniform(rng, 0.002, 0.04), rng.uniform(0.03, 0.14), rng.uniform(0.03, 0.06), _random_tail(rng)
    )
    legs = _random_metal(rng)
    if present:
        spheres.append(Sphere(np.zeros(3, np.float32), 1.0, black))
        cylinders += _random_legs(rng, np.zeros(3), legs)
    elif rng.random() < 0.5:
        spheres.append(_random_decoy(rng, black))
    for _ in range(rng.choice(4, p=(0.45, 0.3, 0.15, 0.1))):
        centre = _beside(rng, rng.uniform(1.6, 5.0), rng.normal(0, 1.5))
        spheres.append(Sphere(centre, 1.0 if rng.random() < 0.8 else rng.uniform(0.3, 0.8), black))
        if rng.random() < 0.7:
            cylinders += _random_legs(rng, centre, legs)
    if rng.random() < 0.35:
        cylinders.append(_random_rod(rng, ground.depth))
    spheres += [_random_lump(rng, ground) for _ in range(rng.choice(3, p=(0.7, 0.2, 0.1)))]
    return World(tuple(spheres), tuple(cylinders), ground, lamps, ambient, surround, present, up)


def _random_up(rng: np.random.Generator) -> Single:
    """Return the direction (3,) up in the room: in the left view it leans to the right by half the vergence."""
    if rng.random() < 0.8:
        return _unit(np.radians(rng.uniform(5, 20)), np.radians(rng.normal(0, 15)))
    return _unit(np.radians(abs(rng.normal(0, 15))), rng.uniform(0, 2 * np.pi))


def _random_ground(rng: np.random.Generator, textures: Single, up: Single) -> Ground:
    depth = _log_uniform(rng, 0.7, 4.0) if rng.random() < 0.3 else rng.uniform(4.0, 16.0)
    return Ground(
        depth=depth,
        normal=_near(rng, up, 15),
        texture=textures[rng.integers(len(textures))],
        scale=_log_uniform(rng, 2.0, 40.0),
        origin=rng.uniform(0, textures.shape[1], 2).astype(np.float32),
        rotation_rad=rng.uniform(0, 2 * np.pi),
        albedo=_log_uniform(rng, 0.05, 0.5),
        contrast=_log_uniform(rng, 0.1, 1.0),
        gloss=_log_uniform(rng, 0.3, 10.0) if rng.random() < 0.6 else 0.0,
        gloss_scale=rng.uniform(0.5, 2.0),
        gloss_level=rng.uniform(1.2, 3.0),
        pit=_log_uniform(rng, 0.03, 0.6) if rng.random() < 0.5 else 1.0,
        pit_scale=rng.uniform(0.3, 2.0),
        pit_level=rng.uniform(0.3, 2.0),
        relief=max(rng.uniform(-2.0, 2.0), 0.0),
        extent=_log_uniform(rng, 10.0, 1000.0),
        rim=_log_uniform(rng, 5.0, 40.0),
        rise=depth * max(rng.uniform(-0.7, 1.5), 0.0),
        steep=rng.uniform(0.3, 1.0),
    )


def _random_bench(
    rng: np.random.Generator, ground: Ground, lamps: tuple[Lamp, ...]
) -> tuple[Ground, tuple[Lamp, ...], float]:
    """Return a uniform, bright bench instead of tissue, under diffuse light with the cart's lamp off or faint."""
    even = replace(
        ground,
        depth=_log_uniform(rng, 2.0, 16.0),
        albedo=rng.uniform(0.4, 0.85),
        contrast=_log_uniform(rng, 0.003, 0.1),
        gloss=0.0,
        pit=1.0,
        relief=0.0,
        extent=1000.0,
        rise=0.0,
    )
    faint = replace(lamps[0], irradiance=rng.uniform(0, 0.15) * (rng.random() < 0.8))
    return even, (faint,), rng.uniform(0.2, 0.35)


def _random_light(rng: np.random.Generator, up: Single) -> tuple[tuple[Lamp, ...], float]:
    """Return lamps and ambient radiance, together about one unit of irradiance.

    The cart's lamp is near the middle between its cameras; those of the room are anywhere above.
    """
    regime = rng.choice(("lamp", "mixed", "overhead", "side"), p=(0.4, 0.25, 0.17, 0.18))
    share = {"lamp": (0.9, 1.0), "mixed": (0.5, 0.9), "overhead": (0.05, 0.5), "side": (0.05, 0.7)}[regime]
    by_lamp = rng.uniform(*share)
    lamps = [Lamp(_near(rng, up, 6), _log_uniform(rng, 0.005, 0.1), by_lamp)]
    rest = 1 - by_lamp
    if regime == "side":
        lamps.append(Lamp(_lean(rng, up, 45, 80), rng.uniform(0.02, 0.15), 0.9 * rest))
    else:
        lamps += [
            Lamp(_lean(rng, up, 0, 55), rng.uniform(0.02, 0.25), 0.9 * rest * part)
            for part in rng.dirichlet(np.ones(rng.integers(1, 6)))
        ]
    return tuple(lamps), float(_log_uniform(rng, 0.01, 0.15) + 0.1 * rest)


def _random_surround(rng: np.random.Generator) -> Surround:
    if rng.random() < 0.5:
        return _NO_SURROUND
    return Surround(_log_uniform(rng, 0.01, 0.2), rng.uniform(0.0, 0.8))


def _random_metal(rng: np.random.Generator) -> Material:
    kind = rng.choice(("black", "dull", "steel"))
    if kind == "black":
        return Material(rng.uniform(0.005, 0.05), rng.uniform(0.05, 0.3), 0.05, _random_tail(rng))
    if kind == "dull":
        return Material(rng.uniform(0.05, 0.4), rng.uniform(0.3, 0.6), 0.08, _random_tail(rng))
    return Material(rng.uniform(0.01, 0.1), rng.uniform(0.08, 0.35), rng.uniform(0.4, 0.7), _random_tail(rng))


def _random_tail(rng: np.random.Generator) -> float:
    return float(np.clip(rng.uniform(-0.5, 1.5), 0, 1))


def _random_legs(rng: np.random.Generator, centre: Floating, material: Material) -> list[Cylinder]:
    """Return the leg of a ball, and possibly one more of its triad that starts at the end of the first."""
    radius = rng.uniform(0.12, 0.4)
    elevation = np.radians(rng.normal(0, 22))
    own = _unit(np.pi / 2 - elevation, rng.uniform(0, 2 * np.pi))
    length = rng.uniform(2.3, 4.7)
    legs = [Cylinder(centre.astype(np.float32), own, length, radius, material)]
    if rng.random() < 0.7:
        joint = (centre + length * own).astype(np.float32)
        away = _unit(np.pi / 2 - np.radians(rng.normal(0, 22)), rng.uniform(0, 2 * np.pi))
        legs.append(Cylinder(joint, away, rng.uniform(2.3, 4.7), radius, material))
    return legs


def _random_rod(rng: np.random.Generator, depth: float) -> Cylinder:
    azimuth = rng.uniform(0, 2 * np.pi)
    direction = _unit(np.pi / 2 - rng.normal(0, 0.1), azimuth)
    aside = rng.uniform(0.3, 4.0)
    start = (
        np.array([-np.sin(azimuth) * aside, np.cos(azimuth) * aside, rng.uniform(-depth, 3)]) - 10 * direction
    )
    return Cylinder(start.astype(np.float32), direction, 20.0, rng.uniform(0.4, 0.9), _random_metal(rng))


def _random_decoy(rng: np.random.Generator, black: Material) -> Sphere:
    """Return an object similar to a ball: too small, too large, or a ball off the centre."""
    if rng.random() < 0.5:
        radius = rng.uniform(0.25, 0.7) if rng.random() < 0.7 else rng.uniform(1.5, 2.5)
        return Sphere(_beside(rng, rng.uniform(0, 0.3), rng.normal(-0.5, 0.5)), radius, black)
    return Sphere(_beside(rng, rng.uniform(0.8, 2.0), 0.0), 1.0, black)


def _random_lump(rng: np.random.Generator, ground: Ground) -> Sphere:
    """Return a lump of tissue or gauze or a screw head beside the ball, below it or in front of part of it."""
    kind = rng.choice(("tissue", "gauze", "screw"), p=(0.6, 0.15, 0.25))
    radius = rng.uniform(0.5, 2.0 if kind == "screw" else 3.0)
    if kind == "screw":
        material = _random_metal(rng)
    else:
        albedo = ground.albedo * rng.uniform(0.4, 2.0) if kind == "tissue" else rng.uniform(0.6, 0.9)
        material = Material(min(albedo, 0.9), rng.uniform(0.2, 0.5), 0.03, 0.0)
    return Sphere(_beside(rng, radius + rng.uniform(0.2, 2.5), rng.uniform(-4.0, 0.5)), radius, material)


def _beside(rng: np.random.Generator, distance: float, height: float) -> Single:
    azimuth = rng.uniform(0, 2 * np.pi)
    return np.array([distance * np.cos(azimuth), distance * np.sin(azimuth), height], np.float32)


def _unit(from_z_rad: float, azimuth_rad: float) -> Single:
    s = np.sin(from_z_rad)
    return np.array([s * np.cos(azimuth_rad), s * np.sin(azimuth_rad), np.cos(from_z_rad)], np.float32)


def _near(rng: np.random.Generator, direction: Single, sd_deg: float) -> Single:
    """Return a unit vector (3,) near another one, with a standard deviation ``sd_deg`` per axis."""
    away = direction + rng.normal(0, np.radians(sd_deg), 3).astype(np.float32)
    return np.asarray(away / np.linalg.norm(away), dtype=np.float32)


def _lean(rng: np.random.Generator, up: Single, low_deg: float, high_deg: float) -> Single:
    """Return a unit vector (3,) at an angle of ``low_deg`` to ``high_deg`` to ``up``."""
    aside = np.cross(up, rng.standard_normal(3))
    aside /= np.linalg.norm(aside)
    lean = np.radians(rng.uniform(low_deg, high_deg))
    return np.asarray(np.cos(lean) * up + np.sin(lean) * aside, dtype=np.float32)


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
