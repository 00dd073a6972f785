from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from spinewatch.simulation.images.families import FAMILIES, UNUSUAL, families_of_sensor, families_of_world
from spinewatch.simulation.images.random_worlds import random_setting, random_world
from spinewatch.simulation.images.sensor import SensorModel
from spinewatch.simulation.images.textures import random_textures
from spinewatch.simulation.images.world import Lamp, World

SHARP = SensorModel((0.5, 0.5), 100.0, veil=0.0, black=0.0, read=1.0, shot=0.02, response=1.0)


@pytest.fixture(scope="module")
def world() -> World:
    rng = np.random.default_rng(3)
    textures = random_textures(rng, 2, 32)
    return random_world(rng, textures, random_setting(rng, textures), present=True)


def test_every_family_depends_on_the_world_or_on_the_sensor(world: World) -> None:
    assert {*families_of_world(world), *families_of_sensor(SHARP)} == set(FAMILIES)
    assert set(FAMILIES) - set(UNUSUAL) == {"glossy"}


@pytest.mark.parametrize(
    ("changes", "family"),
    [
        ({}, None),
        ({"defocus_px": (1.0, 1.2)}, "defocused"),
        ({"motion_px": (0.0, -1.2)}, "shaken"),
        ({"quality": 60}, "compressed"),
        ({"sharpening": 0.5}, "sharpened"),
        ({"read": 3.0}, "noisy"),
    ],
)
def test_a_sensor_belongs_to_the_family_of_what_was_changed(
    changes: dict[str, Any], family: str | None
) -> None:
    belongs = families_of_sensor(replace(SHARP, **changes))
    assert [name for name, yes in belongs.items() if yes] == ([family] if family else [])


@pytest.mark.parametrize(("roughness", "family"), [(0.05, "glossy"), (0.2, "satin"), (0.6, "matte")])
def test_gloss_is_that_of_the_ball_at_the_origin(world: World, roughness: float, family: str) -> None:
    ball, *others = world.spheres
    painted = replace(ball, material=replace(ball.material, roughness=roughness))
    belongs = families_of_world(replace(world, spheres=(painted, *others)))
    assert [name for name in ("glossy", "satin", "matte") if belongs[name]] == [family]


def test_lamps_are_twins_when_the_middle_of_the_cart_s_lamps_is_none_of_them(world: World) -> None:
    here, there = (np.array([x, 0, np.sqrt(1 - x * x)], np.float32) for x in (0.1, -0.1))
    up = np.array([0, 0, 1], np.float32)
    one, other = Lamp(here, 0.05, 0.5), Lamp(there, 0.05, 0.5)
    assert families_of_world(replace(world, lamps=(one, other), lamp=up))["twin lamps"]
    assert not families_of_world(replace(world, lamps=(one, other), lamp=here.copy()))["twin lamps"]
