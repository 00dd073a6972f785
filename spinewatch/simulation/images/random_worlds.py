"""Random worlds for training images: settings of views, and the worlds about balls of one view.

Properties that differ between operating rooms have wide distributions, beyond those of real ones: positions, sizes and
number of the lamps, the tissue, gloss of the balls from polished to matte, blood on them, metal that mirrors. The
worlds of one view share them, because its balls do.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from spinewatch.arrays import Single
from spinewatch.simulation.images.draws import beside, log_uniform, near, unit_vector
from spinewatch.simulation.images.random_light import NO_SURROUND, Light, moved, random_light
from spinewatch.simulation.images.random_objects import (
    random_decoy,
    random_finger,
    random_legs,
    random_lump,
    random_metal,
    random_paint,
    random_rod,
    random_smear,
)
from spinewatch.simulation.images.world import Border, Clot, Cylinder, Ground, Material, Sphere, World

_BENCH = 0.06
"""Fraction of settings that are a bench on which the cart is tested instead of an operating room."""
_DARK = 0.1
"""Fraction of settings whose tissue may be as dark as the balls."""
_SMEARED = 0.2
"""Fraction of settings in which there is blood on the balls."""
_BALL_SMEARED = 0.7
"""Fraction of the balls with blood on them in such a setting."""
_FINGER = 0.08
_ROD = 0.35
_BORDER = 0.15
_SHALLOW = 0.15
"""Fraction of settings whose balls are so near to the tissue that their shadows touch them. Where an outline is faint
the networks expect a shadow as often as they have met one, and place the centre towards the lamp by as much."""
_DEPTH = (0.7, 20.0)
"""Limits of the depth of the ground under a ball."""
_DEPTH_SPREAD, _ALBEDO_SPREAD = 0.3, 0.25
"""Standard deviations of the logarithms of depth and albedo within a view."""
_TILT_SPREAD_DEG = 8.0
"""Standard deviation per axis of the ground's normal within a view."""


@dataclass(frozen=True, eq=False)
class Setting:
    """What the worlds about the balls of one view share.

    Attributes
    ----------
    up
        Direction up in the room, shape (3,).
    ground
        The tissue, or the bench, at one place.
    light
        The light.
    is_bench
        Whether it is a bench instead of an operating room.
    paint
        Surface of the balls.
    legs
        Surface of their legs.
    is_smeared
        Whether there is blood on some of the balls.
    """

    up: Single
    ground: Ground
    light: Light
    is_bench: bool
    paint: Material
    legs: Material
    is_smeared: bool


def random_setting(rng: np.random.Generator, textures: Single) -> Setting:
    """Return the random setting of a view.

    Parameters
    ----------
    rng
        Source of random numbers.
    textures
        Textures of the tissue from `random_textures`, shape (m, n, n).

    Returns
    -------
    Setting
        The setting.
    """
    up = _random_up(rng)
    ground = _random_ground(rng, textures, up)
    light = random_light(rng, up)
    is_bench = rng.random() < _BENCH
    if is_bench:
        ground, light = _random_bench(rng, ground, light)
    paint, legs = random_paint(rng), random_metal(rng)
    is_smeared = rng.random() < _SMEARED and not is_bench
    return Setting(up, ground, light, is_bench, paint, legs, is_smeared)


def random_world(rng: np.random.Generator, textures: Single, setting: Setting, present: bool) -> World:
    """Return a random world of a view with, or without, a ball at its origin.

    Parameters
    ----------
    rng
        Source of random numbers.
    textures
        Textures from `random_textures`, shape (m, n, n).
    setting
        Setting of the view.
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
    >>> textures = random_textures(rng, 2, 32)
    >>> world = random_world(rng, textures, random_setting(rng, textures), present=True)
    >>> world.spheres[0].radius
    1.0
    """
    ground, light = _ground_elsewhere(rng, setting, present), moved(rng, setting.light)
    spheres, cylinders = [], []

    def ball(centre: Single, radius: float = 1.0) -> Sphere:
        smears = setting.is_smeared and rng.random() < _BALL_SMEARED
        return Sphere(centre, radius, setting.paint, random_smear(rng, textures) if smears else None)

    if present:
        spheres.append(ball(np.zeros(3, np.float32)))
        cylinders += random_legs(rng, np.zeros(3), setting.legs)
    elif rng.random() < 0.5:
        spheres.append(random_decoy(rng, setting.paint))
    for _ in range(rng.choice(4, p=(0.45, 0.3, 0.15, 0.1))):
        centre = beside(rng, rng.uniform(1.6, 5.0), rng.normal(0, 1.5))
        spheres.append(ball(centre, 1.0 if rng.random() < 0.8 else rng.uniform(0.3, 0.8)))
        if rng.random() < 0.7:
            cylinders += random_legs(rng, centre, setting.legs)
    cylinders += _random_rods(rng, ground.depth)
    spheres += [random_lump(rng, ground.albedo) for _ in range(rng.choice(3, p=(0.65, 0.22, 0.13)))]
    if rng.random() < _FINGER:
        finger, end = random_finger(rng)
        cylinders.append(finger)
        spheres.append(end)
    return World(
        tuple(spheres),
        tuple(cylinders),
        ground,
        light.lamps,
        light.lamp,
        light.ambient,
        light.glow,
        light.surround,
        present,
        setting.up,
    )


def _random_rods(rng: np.random.Generator, depth: float) -> list[Cylinder]:
    return [random_rod(rng, depth) for _ in range(rng.integers(1, 3))] if rng.random() < _ROD else []


def _random_up(rng: np.random.Generator) -> Single:
    """Return the direction (3,) up in the room: in the left view it leans to the right by half the vergence."""
    if rng.random() < 0.8:
        return unit_vector(np.radians(rng.uniform(5, 20)), np.radians(rng.normal(0, 15)))
    return unit_vector(np.radians(abs(rng.normal(0, 15))), rng.uniform(0, 2 * np.pi))


def _random_ground(rng: np.random.Generator, textures: Single, up: Single) -> Ground:
    """Return the ground of a setting; what differs from place to place is that of one place, without clots."""
    low, high = _DEPTH
    return Ground(
        depth=log_uniform(rng, low, 4.0) if rng.random() < _SHALLOW else rng.uniform(4.0, high),
        normal=near(rng, up, 15),
        texture=textures[rng.integers(len(textures))],
        scale=log_uniform(rng, 2.0, 40.0),
        origin=rng.uniform(0, textures.shape[1], 2).astype(np.float32),
        rotation_rad=rng.uniform(0, 2 * np.pi),
        albedo=log_uniform(rng, 0.015, 0.06) if rng.random() < _DARK else log_uniform(rng, 0.05, 0.5),
        contrast=log_uniform(rng, 0.1, 1.0),
        gloss=log_uniform(rng, 0.3, 10.0) if rng.random() < 0.6 else 0.0,
        gloss_scale=rng.uniform(0.5, 2.0),
        gloss_level=rng.uniform(1.2, 3.0),
        pit=log_uniform(rng, 0.03, 0.6) if rng.random() < 0.5 else 1.0,
        pit_scale=rng.uniform(0.3, 2.0),
        pit_level=rng.uniform(0.3, 2.0),
        relief=0.0,
        extent=log_uniform(rng, 10.0, 1000.0),
        rim=log_uniform(rng, 5.0, 40.0),
        rise=0.0,
        steep=rng.uniform(0.3, 1.0),
        scatter=log_uniform(rng, 0.02, 0.8),
        clots=(),
        border=None,
    )


def _ground_elsewhere(rng: np.random.Generator, setting: Setting, present: bool) -> Ground:
    """Return the ground at another place of a view."""
    ground = setting.ground
    depth = float(np.clip(ground.depth * np.exp(rng.normal(0, _DEPTH_SPREAD)), *_DEPTH))
    origin = rng.uniform(0, len(ground.texture), 2).astype(np.float32)
    here = replace(ground, depth=depth, origin=origin, rotation_rad=rng.uniform(0, 2 * np.pi))
    if setting.is_bench:
        return here
    return replace(
        here,
        normal=near(rng, ground.normal, _TILT_SPREAD_DEG),
        albedo=ground.albedo * float(np.exp(rng.normal(0, _ALBEDO_SPREAD))),
        relief=max(rng.uniform(-2.0, 2.0), 0.0),
        rise=depth * max(rng.uniform(-0.7, 1.5), 0.0),
        clots=_random_clots(rng, present),
        border=_random_border(rng) if rng.random() < _BORDER else None,
    )


def _random_border(rng: np.random.Generator) -> Border:
    azimuth = rng.uniform(0, 2 * np.pi)
    across = np.array([np.cos(azimuth), np.sin(azimuth)], np.float32)
    return Border(across, rng.uniform(-2.0, 5.0), log_uniform(rng, 0.2, 6.0))


def _random_clots(rng: np.random.Generator, present: bool) -> tuple[Clot, ...]:
    """Return spots of the ground; where no ball is, possibly one in the middle that resembles it."""
    resembles = not present and rng.random() < 0.4
    count = int(resembles) + (rng.integers(1, 4) if rng.random() < 0.3 else 0)
    return tuple(
        Clot(
            centre=beside(rng, 0.3 if resembles and i == 0 else rng.uniform(0.0, 6.0), 0.0)[:2],
            radius=rng.uniform(0.7, 1.4) if resembles and i == 0 else log_uniform(rng, 0.4, 3.0),
            stretch=log_uniform(rng, 1.0, 2.5),
            rotation_rad=rng.uniform(0, np.pi),
            softness=log_uniform(rng, 0.1, 1.5),
            factor=log_uniform(rng, 0.02, 0.5) if rng.random() < 0.8 else rng.uniform(1.5, 4.0),
        )
        for i in range(count)
    )


def _random_bench(rng: np.random.Generator, ground: Ground, light: Light) -> tuple[Ground, Light]:
    """Return a uniform, bright bench instead of tissue, under diffuse light with the cart's lamp off or faint."""
    even = replace(
        ground,
        depth=log_uniform(rng, 2.0, 16.0),
        albedo=rng.uniform(0.4, 0.85),
        contrast=log_uniform(rng, 0.003, 0.1),
        gloss=0.0,
        pit=1.0,
        extent=1000.0,
    )
    lamp = replace(light.lamps[0], irradiance=rng.uniform(0, 0.15) * (rng.random() < 0.8))
    diffuse = replace(
        light, lamps=(lamp,), ambient=rng.uniform(0.2, 0.35), glow=0.3 * light.glow, surround=NO_SURROUND
    )
    return even, diffuse
