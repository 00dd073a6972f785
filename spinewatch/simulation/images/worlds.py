"""Worlds drawn at random: a ball on its leg above wet flesh, what stands about it, and the lamps.

Lengths are in radii of the ball, the origin is its centre, z points to the camera, x to the right and y up in the
picture. Everything that another operating room may have is drawn widely: where lamps hang, how rough the ground is,
how glossy the ball.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Single

_BENCH = 0.06
"""The share of worlds that are no operating room but a bench on which somebody tries the cart."""


@dataclass(frozen=True, eq=False)
class Lamp:
    """A round lamp far away: unit ``direction`` (3,) to it, its angular ``radius`` and the irradiance it gives."""

    direction: Single
    radius_rad: float
    irradiance: float


@dataclass(frozen=True, eq=False)
class Material:
    """A surface: diffuse ``albedo`` seen through its coat, ``roughness``, and reflectance ``f0`` at normal incidence.

    ``tail``, 0 to 1, shares the slopes of its facets between the distributions of Beckmann and of GGX, whose glints
    have long tails.
    """

    albedo: float
    roughness: float
    f0: float
    tail: float


@dataclass(frozen=True, eq=False)
class Ball:
    """A sphere: ``centre`` (3,), ``radius``, ``material``."""

    centre: Single
    radius: float
    material: Material


@dataclass(frozen=True, eq=False)
class Bar:
    """A leg, rod or instrument: a cylinder from ``start`` (3,) along ``direction`` (3,) with flat ends."""

    start: Single
    direction: Single
    length: float
    radius: float
    material: Material


@dataclass(frozen=True, eq=False)
class Ground:
    """Flesh: a plane through ``(0, 0, -depth)`` with unit ``normal`` (3,), painted by a texture.

    ``texture`` (n, n) of zero mean and unit variance, taken at ``scale`` texels a radius from ``origin`` (2,) and
    turned by ``turn_rad``; the albedo is ``albedo exp(contrast texture)``. Where the texture, taken ``gloss_scale``
    finer, exceeds ``gloss_level``, it is wet and shines with ``gloss`` times the albedo; where, taken ``pit_scale``
    finer, it falls below ``-pit_level``, there is a pit or a clot, and ``pit`` times the albedo is left. Flesh is
    rough: seen from the side it is darker than from above, by the cosine to the power of ``relief``; and the lamps'
    light ends: half as bright ``extent`` away. ``rim`` away the ground rises to walls, ``rise`` high and ``steep``
    times as bright.
    """

    depth: float
    normal: Single
    texture: Single
    scale: float
    origin: Single
    turn_rad: float
    albedo: float
    contrast: float
    gloss: float
    gloss_scale: float
    gloss_level: float
    pit: float
    pit_scale: float
    pit_level: float
    relief: float
    extent: float
    rim: float
    rise: float
    steep: float


@dataclass(frozen=True)
class Surround:
    """Lit drapes, retractors and people about the wound: ``radiance`` up to the sine ``height`` of the elevation."""

    radiance: float
    height: float


_NOTHING = Surround(0.0, 0.0)


@dataclass(frozen=True, eq=False)
class World:
    """All that a picture shows.

    ``balls[0]`` is the one in question, if ``present``; the first of the ``lamps`` is the cart's; unit ``up`` (3,) of
    the room.
    """

    balls: tuple[Ball, ...]
    bars: tuple[Bar, ...]
    ground: Ground
    lamps: tuple[Lamp, ...]
    ambient: float
    surround: Surround
    present: bool
    up: Single


def draw_world(rng: np.random.Generator, textures: Single, present: bool) -> World:
    """Return a world with, or without, a ball at its origin; ``textures`` (m, n, n) from ``draw_textures``."""
    up = _draw_up(rng)
    ground = _draw_ground(rng, textures, up)
    lamps, ambient = _draw_light(rng, up)
    surround = _draw_surround(rng)
    if rng.random() < _BENCH:
        ground, lamps, ambient = _draw_bench(rng, ground, lamps)
        surround = _NOTHING
    balls, bars = [], []
    black = Material(
        _log_uniform(rng, 0.002, 0.04), rng.uniform(0.03, 0.14), rng.uniform(0.03, 0.06), _draw_tail(rng)
    )
    legs = _draw_metal(rng)
    if present:
        balls.append(Ball(np.zeros(3, np.float32), 1.0, black))
        bars += _draw_legs(rng, np.zeros(3), legs)
    elif rng.random() < 0.5:
        balls.append(_draw_decoy(rng, black))
    for _ in range(rng.choice(4, p=(0.45, 0.3, 0.15, 0.1))):
        centre = _beside(rng, rng.uniform(1.6, 5.0), rng.normal(0, 1.5))
        balls.append(Ball(centre, 1.0 if rng.random() < 0.8 else rng.uniform(0.3, 0.8), black))
        if rng.random() < 0.7:
            bars += _draw_legs(rng, centre, legs)
    if rng.random() < 0.35:
        bars.append(_draw_rod(rng, ground.depth))
    balls += [_draw_lump(rng, ground) for _ in range(rng.choice(3, p=(0.7, 0.2, 0.1)))]
    return World(tuple(balls), tuple(bars), ground, lamps, ambient, surround, present, up)


def draw_textures(rng: np.random.Generator, count: int, size: int) -> Single:
    """Return textures (count, size, size), periodic, of zero mean and unit variance.

    Noise of a random spectral slope, some of it warped to grains, ridges or streaks.
    """
    fy, fx = np.meshgrid(np.fft.fftfreq(size), np.fft.rfftfreq(size), indexing="ij")
    out = np.empty((count, size, size), np.float32)
    for texture in out:
        stretch, turn = rng.uniform(1, 2.5), rng.uniform(0, np.pi)
        a, b = fx * np.cos(turn) + fy * np.sin(turn), fy * np.cos(turn) - fx * np.sin(turn)
        f = np.hypot(a * stretch, b / stretch)
        low, slope = rng.uniform(0.003, 0.03), rng.uniform(0.7, 1.8)
        amplitude = (f * f + low * low) ** (-slope / 2)

        def noise(amplitude: NDArray[np.floating] = amplitude) -> NDArray[np.floating]:
            white = rng.standard_normal((size, size))
            field = np.fft.irfft2(np.fft.rfft2(white) * amplitude, (size, size))
            return np.asarray((field - field.mean()) / field.std())

        field = noise()
        kind = rng.integers(4)
        if kind == 1:  # grains
            field = np.tanh(2 * field) + 0.5 * noise()
        elif kind == 2:  # ridges
            field = -np.abs(field) + 0.4 * noise()
        elif kind == 3:  # spots on an even ground
            field = np.maximum(field - rng.uniform(0.3, 1.2), 0) * rng.choice((-1, 1)) + 0.3 * noise()
        texture[:] = (field - field.mean()) / field.std()
    return out


def _draw_up(rng: np.random.Generator) -> Single:
    """Return where up is in the operating room: in the left view to the right of the camera, by half the vergence."""
    if rng.random() < 0.8:
        return _unit(np.radians(rng.uniform(5, 20)), np.radians(rng.normal(0, 15)))
    return _unit(np.radians(abs(rng.normal(0, 15))), rng.uniform(0, 2 * np.pi))


def _draw_ground(rng: np.random.Generator, textures: Single, up: Single) -> Ground:
    depth = _log_uniform(rng, 0.7, 4.0) if rng.random() < 0.3 else rng.uniform(4.0, 16.0)
    return Ground(
        depth=depth,
        normal=_near(rng, up, 15),
        texture=textures[rng.integers(len(textures))],
        scale=_log_uniform(rng, 2.0, 40.0),
        origin=rng.uniform(0, textures.shape[1], 2).astype(np.float32),
        turn_rad=rng.uniform(0, 2 * np.pi),
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


def _draw_bench(
    rng: np.random.Generator, ground: Ground, lamps: tuple[Lamp, ...]
) -> tuple[Ground, tuple[Lamp, ...], float]:
    """Return a bench instead of a wound: even and bright under diffuse light, with the cart's lamp out or faint."""
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


def _draw_light(rng: np.random.Generator, up: Single) -> tuple[tuple[Lamp, ...], float]:
    """Return the lamps and the ambient radiance; in all they give about one unit of irradiance.

    The cart's lamp hangs between its cameras, more or less; the room's hang anywhere above.
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


def _draw_surround(rng: np.random.Generator) -> Surround:
    if rng.random() < 0.5:
        return _NOTHING
    return Surround(_log_uniform(rng, 0.01, 0.2), rng.uniform(0.0, 0.8))


def _draw_metal(rng: np.random.Generator) -> Material:
    kind = rng.choice(("black", "dull", "steel"))
    if kind == "black":
        return Material(rng.uniform(0.005, 0.05), rng.uniform(0.05, 0.3), 0.05, _draw_tail(rng))
    if kind == "dull":
        return Material(rng.uniform(0.05, 0.4), rng.uniform(0.3, 0.6), 0.08, _draw_tail(rng))
    return Material(rng.uniform(0.01, 0.1), rng.uniform(0.08, 0.35), rng.uniform(0.4, 0.7), _draw_tail(rng))


def _draw_tail(rng: np.random.Generator) -> float:
    return float(np.clip(rng.uniform(-0.5, 1.5), 0, 1))


def _draw_legs(rng: np.random.Generator, centre: NDArray[np.floating], material: Material) -> list[Bar]:
    """Return the ball's own leg, and those of its triad that start where it ends."""
    radius = rng.uniform(0.12, 0.4)
    elevation = np.radians(rng.normal(0, 22))
    own = _unit(np.pi / 2 - elevation, rng.uniform(0, 2 * np.pi))
    length = rng.uniform(2.3, 4.7)
    legs = [Bar(centre.astype(np.float32), own, length, radius, material)]
    if rng.random() < 0.7:
        joint = (centre + length * own).astype(np.float32)
        away = _unit(np.pi / 2 - np.radians(rng.normal(0, 22)), rng.uniform(0, 2 * np.pi))
        legs.append(Bar(joint, away, rng.uniform(2.3, 4.7), radius, material))
    return legs


def _draw_rod(rng: np.random.Generator, depth: float) -> Bar:
    turn = rng.uniform(0, 2 * np.pi)
    direction = _unit(np.pi / 2 - rng.normal(0, 0.1), turn)
    aside = rng.uniform(0.3, 4.0)
    start = np.array([-np.sin(turn) * aside, np.cos(turn) * aside, rng.uniform(-depth, 3)]) - 10 * direction
    return Bar(start.astype(np.float32), direction, 20.0, rng.uniform(0.4, 0.9), _draw_metal(rng))


def _draw_decoy(rng: np.random.Generator, black: Material) -> Ball:
    """Return what may be taken for a ball: too small, too large, or a ball that is not in the middle."""
    if rng.random() < 0.5:
        radius = rng.uniform(0.25, 0.7) if rng.random() < 0.7 else rng.uniform(1.5, 2.5)
        return Ball(_beside(rng, rng.uniform(0, 0.3), rng.normal(-0.5, 0.5)), radius, black)
    return Ball(_beside(rng, rng.uniform(0.8, 2.0), 0.0), 1.0, black)


def _draw_lump(rng: np.random.Generator, ground: Ground) -> Ball:
    """Return a lump of flesh or gauze or the head of a screw beside the ball, lower or before a part of it."""
    kind = rng.choice(("flesh", "gauze", "screw"), p=(0.6, 0.15, 0.25))
    radius = rng.uniform(0.5, 2.0 if kind == "screw" else 3.0)
    if kind == "screw":
        material = _draw_metal(rng)
    else:
        albedo = ground.albedo * rng.uniform(0.4, 2.0) if kind == "flesh" else rng.uniform(0.6, 0.9)
        material = Material(min(albedo, 0.9), rng.uniform(0.2, 0.5), 0.03, 0.0)
    return Ball(_beside(rng, radius + rng.uniform(0.2, 2.5), rng.uniform(-4.0, 0.5)), radius, material)


def _beside(rng: np.random.Generator, distance: float, height: float) -> Single:
    turn = rng.uniform(0, 2 * np.pi)
    return np.array([distance * np.cos(turn), distance * np.sin(turn), height], np.float32)


def _unit(from_z_rad: float, azimuth_rad: float) -> Single:
    s = np.sin(from_z_rad)
    return np.array([s * np.cos(azimuth_rad), s * np.sin(azimuth_rad), np.cos(from_z_rad)], np.float32)


def _near(rng: np.random.Generator, direction: Single, sd_deg: float) -> Single:
    """Return a direction about another one, turned by some ``sd_deg`` each way."""
    away = direction + rng.normal(0, np.radians(sd_deg), 3).astype(np.float32)
    return np.asarray(away / np.linalg.norm(away), dtype=np.float32)


def _lean(rng: np.random.Generator, up: Single, low_deg: float, high_deg: float) -> Single:
    """Return a direction that leans away from ``up`` by ``low_deg`` to ``high_deg``."""
    aside = np.cross(up, rng.standard_normal(3))
    aside /= np.linalg.norm(aside)
    lean = np.radians(rng.uniform(low_deg, high_deg))
    return np.asarray(np.cos(lean) * up + np.sin(lean) * aside, dtype=np.float32)


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
