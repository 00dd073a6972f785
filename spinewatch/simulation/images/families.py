"""Families of looks, for which errors are reported and which fits can leave out."""

from __future__ import annotations

import numpy as np

from spinewatch.simulation.images.sensor import SensorModel
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


def families_of_world(world: World) -> dict[str, bool]:
    """Return whether images of a world belong to each of the families that depend on it.

    Parameters
    ----------
    world
        The world.

    Returns
    -------
    dict
        By name of the family.
    """
    ball = world.spheres[0] if world.present else None
    roughness = ball.material.roughness if ball else np.nan
    return {
        "glossy": roughness < _SATIN,
        "satin": _SATIN <= roughness < _MATTE,
        "matte": roughness >= _MATTE,
        "smeared": ball is not None and ball.smear is not None,
        "dark tissue": world.ground.albedo < _DARK,
        "side lamp": any(lamp.direction[2] < _RAKING and lamp.irradiance > _STRONG for lamp in world.lamps),
        "twin lamps": len(world.lamps) > 1 and not np.array_equal(world.lamps[0].direction, world.lamp),
    }


def families_of_sensor(sensor: SensorModel) -> dict[str, bool]:
    """Return whether images of a sensor belong to each of the families that depend on it.

    Parameters
    ----------
    sensor
        The sensor.

    Returns
    -------
    dict
        By name of the family.
    """
    return {
        "defocused": max(sensor.defocus_px) > 0,
        "shaken": max(np.abs(sensor.motion_px)) > 0,
        "compressed": sensor.quality is not None,
        "sharpened": sensor.sharpening > 0,
        "noisy": sensor.read > _NOISY,
    }
