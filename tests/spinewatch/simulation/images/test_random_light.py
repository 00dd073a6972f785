import numpy as np
import pytest

from spinewatch.simulation.images.draws import unit_vector
from spinewatch.simulation.images.random_light import random_light

UP = unit_vector(0.2, 0.0)


def test_lamps_and_room_give_about_one_unit_of_irradiance() -> None:
    rng = np.random.default_rng(3)
    for _ in range(300):
        light = random_light(rng, UP)
        irradiance = sum(lamp.irradiance for lamp in light.lamps) + np.pi * light.ambient
        assert 0.6 < irradiance < 1.8
        assert all(np.linalg.norm(lamp.direction) == pytest.approx(1, abs=1e-4) for lamp in light.lamps)
        assert np.linalg.norm(light.glow) < 1  # radiance is positive in every direction


def test_the_cart_s_lamp_is_near_the_middle_between_the_cameras() -> None:
    rng = np.random.default_rng(4)
    lamps = np.array([random_light(rng, UP).lamp for _ in range(500)])
    assert lamps.mean(axis=0)[:2] == pytest.approx(UP[:2], abs=0.02)
    assert 5 < np.degrees(lamps.std(axis=0)[1]) < 9


def test_of_lamps_about_both_cameras_the_middle_is_the_cart_s_lamp() -> None:
    rng = np.random.default_rng(5)
    twins = [
        light
        for light in (random_light(rng, UP) for _ in range(300))
        if not any(lamp.direction is light.lamp for lamp in light.lamps)
    ]
    assert 15 < len(twins) < 70
    for light in twins:
        here, there = light.lamps[0].direction, light.lamps[1].direction
        assert np.hypot(*here[:2]) < 0.15
        middle = (here + there) / np.linalg.norm(here + there)
        assert middle == pytest.approx(light.lamp, abs=1e-3)


def test_some_lamps_are_at_the_side_and_strong() -> None:
    rng = np.random.default_rng(6)
    lights = [random_light(rng, UP) for _ in range(300)]
    raking = [any(lamp.direction @ UP < 0.6 and lamp.irradiance > 0.4 for lamp in x.lamps) for x in lights]
    assert 0.03 < np.mean(raking) < 0.3
