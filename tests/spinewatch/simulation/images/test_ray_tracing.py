"""Ray tracing against optics that can be calculated by hand."""

from dataclasses import replace

import numpy as np
import pytest

from spinewatch.arrays import Single
from spinewatch.simulation.images.ray_tracing import trace
from spinewatch.simulation.images.world import Cylinder, Ground, Lamp, Material, Sphere, Surround, World

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
        rotation_rad=0.0,
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
    ball = Sphere(np.zeros(3, np.float32), 1.0, BLACK)
    return World((ball,), (), ground, (lamp,), 0.02, Surround(0.0, 0.0), True, UP)


def view(reach: float, n: int = 401) -> tuple[Single, Single]:
    line = np.linspace(-reach, reach, n, dtype=np.float32)
    x, y = np.meshgrid(line, line[::-1])
    return x, y


@pytest.mark.parametrize(("a", "b"), [(0.0, 0.0), (0.3, -0.1), (-0.6, 0.4)])
def test_the_highlight_is_where_the_normal_bisects_the_angle_to_the_lamp(a: float, b: float) -> None:
    lamp = Lamp(unit(a, b, 1), 0.01, 1.0)
    x, y = view(1.0)
    radiance, visible = trace(plain_world(lamp), x, y)
    bright = np.unravel_index(np.argmax(np.where(visible & (np.hypot(x, y) < 0.8), radiance, 0)), x.shape)
    half = lamp.direction + UP
    half = half / np.linalg.norm(half)
    assert (x[bright], y[bright]) == pytest.approx((half[0], half[1]), abs=0.02)


def test_the_shadow_is_displaced_by_the_height_of_the_ball() -> None:
    lamp = Lamp(unit(0.5, 0.0, 1), 0.001, 1.0)
    x, y = view(9.0)
    radiance, visible = trace(plain_world(lamp, depth=10.0), x, y)
    shadow = ~visible & (radiance < 0.5 * np.median(radiance))
    assert x[shadow].mean() == pytest.approx(-5.0, abs=0.1)
    assert y[shadow].mean() == pytest.approx(0.0, abs=0.05)


@pytest.mark.parametrize(("r", "reflectance"), [(0.0, 0.04), (0.6, 0.0439), (0.69, 0.0488)])
def test_the_room_is_reflected_by_fresnel_s_equations(r: float, reflectance: float) -> None:
    world = plain_world(Lamp(UP, 0.01, 0.0))
    x = np.array([[r]], np.float32)
    radiance, _ = trace(world, x, 0 * x)
    assert radiance[0, 0] == pytest.approx(reflectance * world.ambient, rel=1e-3)


def test_walls_are_reflected_instead_of_the_room() -> None:
    world = plain_world(Lamp(UP, 0.01, 1.0))
    walled = replace(world, ground=replace(world.ground, rise=5.0, steep=0.5))
    x = np.array([[0.69], [0.3]], np.float32)  # reflecting just above the horizon, and far above it
    (room, _), (wall, _) = trace(world, x, 0 * x), trace(walled, x, 0 * x)
    glow = 0.4 * (1 / np.pi + world.ambient)
    assert wall[0, 0] / room[0, 0] == pytest.approx(0.5 * glow / world.ambient, rel=0.02)
    assert wall[1, 0] == room[1, 0]


def test_the_surround_is_reflected_near_the_horizon_only() -> None:
    world = plain_world(Lamp(UP, 0.01, 0.0))
    draped = replace(world, surround=Surround(0.1, 0.5))
    x = np.array([[0.69], [0.3]], np.float32)  # reflecting just above the horizon, and far above it
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


def test_a_rod_in_front_of_the_ball_hides_it() -> None:
    world = plain_world(Lamp(UP, 0.01, 1.0))
    x, y = view(1.5)
    _, whole = trace(world, x, y)
    area = whole.sum() * (x[0, 1] - x[0, 0]) ** 2
    assert area == pytest.approx(np.pi, rel=0.01)
    rod = Cylinder(np.array([-5, 0, 2], np.float32), unit(1, 0, 0), 10.0, 0.5, BLACK)
    _, part = trace(replace(world, cylinders=(rod,)), x, y)
    # The area of a disc outside a band of half its radius.
    left = np.pi - 2 * (np.arcsin(0.5) + 0.5 * np.sqrt(0.75))
    assert part.sum() / whole.sum() == pytest.approx(left / np.pi, abs=0.01)
    behind = replace(rod, start=np.array([-5, 0, -2], np.float32))
    assert np.array_equal(trace(replace(world, cylinders=(behind,)), x, y)[1], whole)


def test_a_ball_in_the_shadow_of_a_rod_has_no_highlight() -> None:
    lamp = Lamp(unit(0.5, 0.0, 1), 0.01, 1.0)
    world = plain_world(lamp, depth=3.0)
    x = np.array([[3.0, -3.0]], np.float32)
    rod = Cylinder(np.array([3.5, -5, -2], np.float32), unit(0, 1, 0), 10.0, 0.3, BLACK)
    (bright,), (shaded,) = trace(world, x, 0 * x)[0], trace(replace(world, cylinders=(rod,)), x, 0 * x)[0]
    assert shaded[0] < 0.2 * bright[0]
    assert shaded[1] == bright[1]
