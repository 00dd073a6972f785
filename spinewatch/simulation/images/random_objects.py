"""Random objects of a world: balls, legs, rods, screws, lumps of tissue, gloved fingers; and their materials."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from spinewatch.arrays import Floating, Single
from spinewatch.simulation.images.draws import beside, log_uniform, unit_vector
from spinewatch.simulation.images.world import Cylinder, Material, Smear, Sphere


def random_paint(rng: np.random.Generator) -> Material:
    """Return the black of balls: polished, satin or matte; rough paint is less black.

    Parameters
    ----------
    rng
        Source of random numbers.

    Returns
    -------
    Material
        The paint.
    """
    roughness = rng.uniform(0.02, 0.14) if rng.random() < 0.5 else log_uniform(rng, 0.12, 0.9)
    albedo = log_uniform(rng, 0.002, 0.04 if roughness < 0.14 else 0.12)
    return Material(albedo, roughness, rng.uniform(0.02, 0.06), _random_tail(rng))


def random_metal(rng: np.random.Generator) -> Material:
    """Return the surface of legs, rods and screws: black, dull, brushed or polished.

    Parameters
    ----------
    rng
        Source of random numbers.

    Returns
    -------
    Material
        The surface.
    """
    kind = rng.choice(("black", "dull", "brushed", "polished"))
    if kind == "black":
        return Material(rng.uniform(0.005, 0.05), log_uniform(rng, 0.05, 0.6), 0.05, _random_tail(rng))
    if kind == "dull":
        return Material(rng.uniform(0.05, 0.4), rng.uniform(0.3, 0.6), 0.08, _random_tail(rng))
    if kind == "brushed":
        return Material(
            rng.uniform(0.01, 0.1), rng.uniform(0.08, 0.35), rng.uniform(0.4, 0.7), _random_tail(rng)
        )
    return Material(
        rng.uniform(0.0, 0.03), log_uniform(rng, 0.01, 0.08), rng.uniform(0.5, 0.9), _random_tail(rng)
    )


def _random_tail(rng: np.random.Generator) -> float:
    return float(np.clip(rng.uniform(-0.5, 1.5), 0, 1))


def random_smear(rng: np.random.Generator, textures: Single) -> Smear:
    """Return blood on a ball, wet or dry, thin or opaque, from spots to almost everything.

    Parameters
    ----------
    rng
        Source of random numbers.
    textures
        Textures, shape (m, n, n).

    Returns
    -------
    Smear
        The blood.
    """
    blood = Material(
        log_uniform(rng, 0.008, 0.2), log_uniform(rng, 0.03, 0.5), rng.uniform(0.02, 0.05), _random_tail(rng)
    )
    return Smear(
        blood,
        textures[rng.integers(len(textures))],
        log_uniform(rng, 2.0, 25.0),
        rng.uniform(0, textures.shape[1], 2).astype(np.float32),
        rng.uniform(-1.5, 1.5),
        log_uniform(rng, 0.1, 3.0),
    )


def random_legs(rng: np.random.Generator, centre: Floating, material: Material) -> list[Cylinder]:
    """Return the leg of a ball, and possibly one more of its triad that starts at the end of the first.

    Parameters
    ----------
    rng
        Source of random numbers.
    centre
        Centre of the ball, shape (3,).
    material
        Surface of the legs.

    Returns
    -------
    list of Cylinder
        The legs.
    """
    radius = rng.uniform(0.12, 0.4)
    elevation = np.radians(rng.normal(0, 22))
    own = unit_vector(np.pi / 2 - elevation, rng.uniform(0, 2 * np.pi))
    length = rng.uniform(2.3, 4.7)
    legs = [Cylinder(centre.astype(np.float32), own, length, radius, material)]
    if rng.random() < 0.7:
        joint = (centre + length * own).astype(np.float32)
        away = unit_vector(np.pi / 2 - np.radians(rng.normal(0, 22)), rng.uniform(0, 2 * np.pi))
        legs.append(Cylinder(joint, away, rng.uniform(2.3, 4.7), radius, material))
    return legs


def random_rod(rng: np.random.Generator, depth: float) -> Cylinder:
    """Return a long rod beside the ball, below it or in front of it.

    Parameters
    ----------
    rng
        Source of random numbers.
    depth
        Depth of the ground under the ball's centre.

    Returns
    -------
    Cylinder
        The rod.
    """
    return _bar(rng, rng.uniform(0.3, 4.0), rng.uniform(-depth, 3), rng.uniform(0.4, 0.9), random_metal(rng))


def random_finger(rng: np.random.Generator) -> tuple[Cylinder, Sphere]:
    """Return a gloved finger with its rounded end, or a handle, beside the ball or in front of part of it.

    Parameters
    ----------
    rng
        Source of random numbers.

    Returns
    -------
    bar : Cylinder
        The finger.
    end : Sphere
        Its end.
    """
    radius = rng.uniform(0.8, 2.5)
    rubber = Material(log_uniform(rng, 0.15, 0.85), log_uniform(rng, 0.1, 0.5), 0.04, 0.0)
    bar = _bar(rng, radius + rng.uniform(-0.6, 2.5), rng.uniform(-3.0, 5.0), radius, rubber)
    bar = replace(bar, start=bar.start + bar.direction * rng.uniform(6, 12))
    return bar, Sphere(bar.start, radius, rubber)


def _bar(
    rng: np.random.Generator, aside: float, height: float, radius: float, material: Material
) -> Cylinder:
    """Return a long, nearly level cylinder whose axis passes the origin at a distance in the image, at a height."""
    azimuth = rng.uniform(0, 2 * np.pi)
    direction = unit_vector(np.pi / 2 - rng.normal(0, 0.1), azimuth)
    start = np.array([-np.sin(azimuth) * aside, np.cos(azimuth) * aside, height]) - 10 * direction
    return Cylinder(start.astype(np.float32), direction, 20.0, radius, material)


def random_decoy(rng: np.random.Generator, paint: Material) -> Sphere:
    """Return an object similar to a ball: too small, too large, or a ball off the centre.

    Parameters
    ----------
    rng
        Source of random numbers.
    paint
        Its surface.

    Returns
    -------
    Sphere
        The object.
    """
    if rng.random() < 0.5:
        radius = rng.uniform(0.25, 0.7) if rng.random() < 0.7 else rng.uniform(1.5, 2.5)
        return Sphere(beside(rng, rng.uniform(0, 0.3), rng.normal(-0.5, 0.5)), radius, paint)
    return Sphere(beside(rng, rng.uniform(0.8, 2.0), 0.0), 1.0, paint)


def random_lump(rng: np.random.Generator, albedo: float) -> Sphere:
    """Return a lump of tissue or gauze or a screw head beside the ball, below it or in front of part of it.

    Parameters
    ----------
    rng
        Source of random numbers.
    albedo
        Albedo of the tissue.

    Returns
    -------
    Sphere
        The lump.
    """
    kind = rng.choice(("tissue", "gauze", "screw"), p=(0.5, 0.15, 0.35))
    radius = rng.uniform(0.5, 2.0 if kind == "screw" else 3.0)
    if kind == "screw":
        material = random_metal(rng)
    else:
        albedo = albedo * rng.uniform(0.4, 2.0) if kind == "tissue" else rng.uniform(0.6, 0.9)
        material = Material(min(albedo, 0.9), rng.uniform(0.05, 0.5), 0.03, 0.0)
    return Sphere(beside(rng, radius + rng.uniform(0.2, 2.5), rng.uniform(-4.0, 0.5)), radius, material)
