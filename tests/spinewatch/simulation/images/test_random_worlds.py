import numpy as np
import pytest

from spinewatch.simulation.images.random_worlds import random_setting, random_world
from spinewatch.simulation.images.ray_tracing import trace
from spinewatch.simulation.images.textures import random_textures


@pytest.mark.parametrize("seed", range(3))
def test_random_worlds_have_finite_radiance(seed: int) -> None:
    rng = np.random.default_rng(seed)
    textures = random_textures(rng, 4, 64)
    line = np.linspace(-3, 3, 60, dtype=np.float32)
    x, y = np.meshgrid(line, line[::-1])
    for present in [True, False] * 30:
        world = random_world(rng, textures, random_setting(rng, textures), present)
        radiance, visible = trace(world, x, y)
        assert np.isfinite(radiance).all()
        assert radiance.min() >= 0
        assert world.present == present
        if not present and visible.any():
            first = world.spheres[0]
            assert first.radius != 1 or first.centre[:2].any()


def test_lamps_and_ambient_light_give_about_one_unit_of_irradiance() -> None:
    rng = np.random.default_rng(8)
    textures = random_textures(rng, 4, 64)
    settings = [random_setting(rng, textures) for _ in range(300)]
    worlds = [random_world(rng, textures, setting, present=True) for setting in settings]
    for world in worlds:
        irradiance = sum(lamp.irradiance for lamp in world.lamps) + np.pi * world.ambient
        assert 0.6 < irradiance < 1.8
        for lamp in world.lamps:
            assert np.linalg.norm(lamp.direction) == pytest.approx(1, abs=1e-5)
    assert all(
        np.linalg.norm(bar.direction) == pytest.approx(1, abs=1e-5) for w in worlds for bar in w.cylinders
    )


def test_a_bench_is_uniform_and_its_light_is_diffuse() -> None:
    rng = np.random.default_rng(8)
    textures = random_textures(rng, 4, 64)
    settings = [random_setting(rng, textures) for _ in range(300)]
    worlds = [random_world(rng, textures, setting, present=True) for setting in settings]
    benches = [w for w in worlds if w.ground.contrast <= 0.1 and sum(x.irradiance for x in w.lamps) < 0.2]
    assert 5 < len(benches) < 40
    assert all(np.pi * bench.ambient > 0.6 for bench in benches)
    assert all(bench.surround.radiance == 0 for bench in benches)


def test_the_worlds_of_a_view_share_materials_and_light_and_differ_in_their_surroundings() -> None:
    rng = np.random.default_rng(9)
    textures = random_textures(rng, 4, 64)
    smeared = 0
    for _ in range(40):
        setting = random_setting(rng, textures)
        worlds = [random_world(rng, textures, setting, present=True) for _ in range(8)]
        balls = [world.spheres[0] for world in worlds]
        assert all(ball.material is setting.paint for ball in balls)
        assert len({world.ground.depth for world in worlds}) > 1
        for world in worlds:
            assert world.lamp @ setting.light.lamp > np.cos(np.radians(10))
            assert [lamp.irradiance for lamp in world.lamps] == [x.irradiance for x in setting.light.lamps]
        if not setting.is_smeared:
            assert all(ball.smear is None for ball in balls)
        smeared += any(ball.smear is not None for ball in balls)
    assert 2 < smeared < 20
