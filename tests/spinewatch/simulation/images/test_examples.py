"""Simulated pictures: optics that can be worked out by hand."""

from dataclasses import replace

import numpy as np
import pytest

from spinewatch.arrays import Single
from spinewatch.detection.refinement.patches import PatchGrid
from spinewatch.simulation.images.examples import ExampleParameters, draw_examples
from spinewatch.simulation.images.sensor import Sensor, expose
from spinewatch.simulation.images.trace import trace
from spinewatch.simulation.images.worlds import (
    Ball,
    Bar,
    Ground,
    Lamp,
    Material,
    Surround,
    World,
    draw_textures,
    draw_world,
)

BLACK = Material(0.0, 0.05, 0.04, 0.0)
UP = np.array([0, 0, 1], np.float32)


def unit(x: float, y: float, z: float) -> Single:
    v = np.array([x, y, z], np.float32)
    return np.asarray(v / np.linalg.norm(v))


def plain_world(lamp: Lamp, depth: float = 3.0) -> World:
    flat = np.zeros((16, 16), np.float32)
    ground = Ground(
        depth=depth,
        normal=UP,
        texture=flat,
        scale=1.0,
        origin=np.zeros(2, np.float32),
        turn_rad=0.0,
        albedo=0.4,
        contrast=0.0,
        gloss=0.0,
        gloss_scale=1.0,
        gloss_level=1.0,
        pit=1.0,
        pit_scale=1.0,
        pit_level=1.0,
        relief=0.0,
        extent=1e6,
        rim=10.0,
        rise=0.0,
        steep=1.0,
    )
    ball = Ball(np.zeros(3, np.float32), 1.0, BLACK)
    return World((ball,), (), ground, (lamp,), 0.02, Surround(0.0, 0.0), True, UP)


def view(reach: float, n: int = 401) -> tuple[Single, Single]:
    line = np.linspace(-reach, reach, n, dtype=np.float32)
    x, y = np.meshgrid(line, line[::-1])
    return x, y


@pytest.mark.parametrize(("a", "b"), [(0.0, 0.0), (0.3, -0.1), (-0.6, 0.4)])
def test_the_lamp_is_mirrored_where_the_normal_halves_the_angle(a: float, b: float) -> None:
    lamp = Lamp(unit(a, b, 1), 0.01, 1.0)
    x, y = view(1.0)
    radiance, seen = trace(plain_world(lamp), x, y)
    bright = np.unravel_index(np.argmax(np.where(seen & (np.hypot(x, y) < 0.8), radiance, 0)), x.shape)
    half = lamp.direction + UP
    half = half / np.linalg.norm(half)
    assert (x[bright], y[bright]) == pytest.approx((half[0], half[1]), abs=0.02)


def test_the_shadow_lies_away_from_the_lamp_by_the_height_of_the_ball() -> None:
    lamp = Lamp(unit(0.5, 0.0, 1), 0.001, 1.0)
    x, y = view(9.0)
    radiance, seen = trace(plain_world(lamp, depth=10.0), x, y)
    shadow = ~seen & (radiance < 0.5 * np.median(radiance))
    assert x[shadow].mean() == pytest.approx(-5.0, abs=0.1)
    assert y[shadow].mean() == pytest.approx(0.0, abs=0.05)


@pytest.mark.parametrize(("r", "reflectance"), [(0.0, 0.04), (0.6, 0.0439), (0.69, 0.0488)])
def test_the_room_is_mirrored_by_fresnel_s_reflectance(r: float, reflectance: float) -> None:
    world = plain_world(Lamp(UP, 0.01, 0.0))
    x = np.array([[r]], np.float32)
    radiance, _ = trace(world, x, 0 * x)
    assert radiance[0, 0] == pytest.approx(reflectance * world.ambient, rel=1e-3)


def test_walls_are_mirrored_where_else_the_room_is() -> None:
    world = plain_world(Lamp(UP, 0.01, 1.0))
    walled = replace(world, ground=replace(world.ground, rise=5.0, steep=0.5))
    x = np.array([[0.69], [0.3]], np.float32)  # mirrored just above the horizon, and far above it
    (room, _), (wall, _) = trace(world, x, 0 * x), trace(walled, x, 0 * x)
    glow = 0.4 * (1 / np.pi + world.ambient)
    assert wall[0, 0] / room[0, 0] == pytest.approx(0.5 * glow / world.ambient, rel=0.02)
    assert wall[1, 0] == room[1, 0]


def test_what_stands_about_the_wound_is_mirrored_near_the_horizon_only() -> None:
    world = plain_world(Lamp(UP, 0.01, 0.0))
    draped = replace(world, surround=Surround(0.1, 0.5))
    x = np.array([[0.69], [0.3]], np.float32)  # mirrored just above the horizon, and far above it
    (room, _), (drapes, _) = trace(world, x, 0 * x), trace(draped, x, 0 * x)
    assert drapes[0, 0] / room[0, 0] == pytest.approx((0.1 + world.ambient) / world.ambient, rel=1e-3)
    assert drapes[1, 0] == room[1, 0]


def test_pits_are_dark_and_lie_where_the_texture_is_low() -> None:
    world = plain_world(Lamp(UP, 0.01, 1.0))
    texture = np.where(np.arange(16) < 8, -2.0, 0.0).astype(np.float32)[None].repeat(16, axis=0)
    pitted = replace(world, ground=replace(world.ground, texture=texture, pit=0.1))
    x = np.array([[3.5, 12.0]], np.float32)  # both clear of the ball and its shadow
    (even,), (dark,) = trace(world, x, 0 * x)[0], trace(pitted, x, 0 * x)[0]
    assert dark[0] == pytest.approx(0.1 * even[0])
    assert dark[1] == even[1]


def test_a_bench_is_even_and_its_light_comes_from_everywhere() -> None:
    rng = np.random.default_rng(8)
    textures = draw_textures(rng, 4, 64)
    worlds = [draw_world(rng, textures, present=True) for _ in range(300)]
    benches = [w for w in worlds if w.ground.contrast <= 0.1 and sum(x.irradiance for x in w.lamps) < 0.2]
    assert 5 < len(benches) < 40
    assert all(np.pi * bench.ambient > 0.6 for bench in benches)


def test_what_stands_before_the_ball_hides_it() -> None:
    world = plain_world(Lamp(UP, 0.01, 1.0))
    x, y = view(1.5)
    _, whole = trace(world, x, y)
    area = whole.sum() * (x[0, 1] - x[0, 0]) ** 2
    assert area == pytest.approx(np.pi, rel=0.01)
    rod = Bar(np.array([-5, 0, 2], np.float32), unit(1, 0, 0), 10.0, 0.5, BLACK)
    _, part = trace(replace(world, bars=(rod,)), x, y)
    # What is left of a disc outside a band of half its radius.
    left = np.pi - 2 * (np.arcsin(0.5) + 0.5 * np.sqrt(0.75))
    assert part.sum() / whole.sum() == pytest.approx(left / np.pi, abs=0.01)
    behind = replace(rod, start=np.array([-5, 0, -2], np.float32))
    assert np.array_equal(trace(replace(world, bars=(behind,)), x, y)[1], whole)


def test_a_sensor_keeps_the_mean_level_and_makes_the_noise_it_says() -> None:
    radiance = np.full((400, 400), 0.3, np.float32)
    sensor = Sensor((0.5, 0.5), 100.0, 0.0, 0.0, 2.0, 0.05, 1.0)
    levels = expose(radiance, 4, sensor, np.random.default_rng(1))
    assert levels.shape == (100, 100)
    assert levels.mean() == pytest.approx(100, abs=0.2)
    assert levels.std() == pytest.approx(np.sqrt(4 + 5 + 1 / 12), rel=0.05)


@pytest.mark.parametrize("seed", range(3))
def test_random_worlds_give_finite_light(seed: int) -> None:
    rng = np.random.default_rng(seed)
    textures = draw_textures(rng, 4, 64)
    assert textures.mean(axis=(1, 2)) == pytest.approx(0, abs=1e-4)
    assert textures.std(axis=(1, 2)) == pytest.approx(1, abs=1e-4)
    x, y = view(3.0, 60)
    for present in [True, False] * 30:
        world = draw_world(rng, textures, present)
        radiance, seen = trace(world, x, y)
        assert np.isfinite(radiance).all()
        assert radiance.min() >= 0
        assert present or not seen.any() or world.balls[0].radius != 1 or world.balls[0].centre[:2].any()


def test_examples_follow_from_their_seed() -> None:
    parameters = ExampleParameters(PatchGrid(25, 5.0), (8.0, 12.0), wider=20.0)
    one, again = (draw_examples(np.random.default_rng(5), 12, parameters) for _ in range(2))
    for name, values in vars(one).items():
        assert np.array_equal(values, getattr(again, name))
    assert one.patches.shape == (12, 25, 25)
    assert np.isfinite(one.patches).all()
    assert 0 < one.ball.sum() < 12
