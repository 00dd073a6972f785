"""Ray tracing against optics that can be calculated by hand."""

from dataclasses import replace

import numpy as np
import pytest

from spinewatch.arrays import Single
from spinewatch.simulation.images.ray_tracing import trace
from spinewatch.simulation.images.world import (
    Border,
    Clot,
    Cylinder,
    Ground,
    Lamp,
    Material,
    Smear,
    Sphere,
    Surround,
    World,
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
    still = np.zeros(3, np.float32)
    return World((ball,), (), ground, (lamp,), lamp.direction, 0.02, still, Surround(0.0, 0.0), True, UP)


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


def test_the_ground_between_evaluated_points_is_interpolated() -> None:
    world = plain_world(Lamp(unit(0.5, 0.0, 1), 0.1, 1.0))
    x, y = view(6.0, n=200)
    (fine, whole), (coarse, same) = trace(world, x, y), trace(world, x, y, ground_step=2)
    assert np.array_equal(whole, same)
    assert np.abs(fine - coarse).mean() < 0.01 * fine.mean()
    assert np.array_equal(fine[whole], coarse[whole])


def test_a_matte_ball_is_lit_by_the_cosine_of_the_angle_to_the_lamp() -> None:
    world = plain_world(Lamp(unit(1.0, 0.0, 1), 0.01, 1.0))
    matte = Material(0.1, 0.9, 1e-4, 0.0)
    ball = replace(world.spheres[0], material=matte)
    lit = replace(world, spheres=(ball,), ambient=0.0, ground=replace(world.ground, albedo=0.0))
    x = np.array([[0.0, 0.5, -0.9]], np.float32)
    radiance = trace(lit, x, 0 * x)[0][0]
    cosine = (0.5 * 1 + np.sqrt(0.75)) / np.sqrt(2), 1 / np.sqrt(2)
    assert radiance[1] / radiance[0] == pytest.approx(cosine[0] / cosine[1], rel=0.02)
    assert radiance[2] == pytest.approx(0, abs=1e-4)


def test_the_underside_of_a_matte_ball_is_lit_by_the_ground() -> None:
    world = plain_world(Lamp(UP, 0.01, 1.0))
    matte = replace(world.spheres[0], material=Material(0.1, 0.9, 1e-4, 0.0))
    dark, bright = (
        replace(world, spheres=(matte,), ambient=0.0, ground=replace(world.ground, albedo=albedo))
        for albedo in (0.0, 0.4)
    )
    x = np.array([[0.0, 0.7]], np.float32)
    gain = trace(bright, x, 0 * x)[0] - trace(dark, x, 0 * x)[0]
    assert gain[0, 1] > 5 * gain[0, 0] > -1e-6
    assert gain[0, 1] == pytest.approx(0.1 * 0.4 / np.pi * (1 - np.sqrt(1 - 0.7**2)) / 2, rel=0.05)


def test_the_room_is_brighter_where_it_glows() -> None:
    world = plain_world(Lamp(UP, 0.01, 0.0))
    glowing = replace(world, glow=np.array([0.5, 0, 0], np.float32))
    x = np.array([[0.6, -0.6]], np.float32)
    even, uneven = trace(world, x, 0 * x)[0][0], trace(glowing, x, 0 * x)[0][0]
    across = 2 * 0.6 * 0.8  # the x component of the reflected direction
    assert uneven / even == pytest.approx([1 + 0.5 * across, 1 - 0.5 * across], rel=1e-3)


def test_a_disc_is_reflected_evenly_with_a_sharp_edge() -> None:
    lamp = Lamp(UP, 0.4, 1.0, is_disc=True)
    world = plain_world(lamp)
    glossy = replace(world.spheres[0], material=Material(0.0, 0.02, 0.04, 0.0))
    x = np.array([[0.0, 0.1, 0.15, 0.25]], np.float32)
    radiance = trace(replace(world, spheres=(glossy,)), x, 0 * x)[0][0]
    assert radiance[:3] == pytest.approx(radiance[0], rel=0.03)
    assert radiance[0] == pytest.approx(0.04 / (np.pi * 0.2**2) / 4 + 0.04 * world.ambient, rel=0.02)
    assert radiance[3] < 0.1 * radiance[0]


def test_blood_covers_a_ball_where_its_texture_is_high() -> None:
    world = plain_world(Lamp(UP, 0.01, 1.0))
    texture = np.where(np.arange(16) < 8, 2.0, -2.0).astype(np.float32)[None].repeat(16, axis=0)
    blood = Material(0.3, 0.9, 1e-4, 0.0)
    smear = Smear(blood, texture, 2.0, np.array([8.0, 8.0], np.float32), 0.0, 0.1)
    ball = replace(world.spheres[0], smear=smear)
    x = np.array([[-0.6, 0.6]], np.float32)
    clean, smeared = trace(world, x, 0 * x)[0][0], trace(replace(world, spheres=(ball,)), x, 0 * x)[0][0]
    assert smeared[0] > clean[0] + 0.3 * 0.7 / np.pi
    assert smeared[1] == clean[1]


def test_a_clot_and_the_ground_beyond_a_border_have_their_albedo() -> None:
    world = plain_world(Lamp(UP, 0.01, 1.0))
    clot = Clot(np.array([6, 0], np.float32), 1.0, 1.0, 0.0, 0.1, 0.2)
    border = Border(np.array([-1, 0], np.float32), 4.0, 2.0)
    other = replace(world, ground=replace(world.ground, clots=(clot,), border=border))
    x = np.array([[6.0, 3.0, -3.0, -6.0]], np.float32)
    assert trace(other, x, 0 * x)[0] / trace(world, x, 0 * x)[0] == pytest.approx(
        np.array([[0.2, 1.0, 1.0, 2.0]]), rel=1e-4
    )


def test_light_that_scatters_in_tissue_softens_the_edges_of_shadows() -> None:
    world = plain_world(Lamp(unit(0.5, 0.0, 1), 0.001, 1.0), depth=10.0)
    soft = replace(world, ground=replace(world.ground, scatter=0.5))
    x = np.linspace(-7.5, -2.5, 400, dtype=np.float32)[None]
    hard_edge, soft_edge = (np.abs(np.diff(trace(w, x, 0 * x)[0][0])).max() for w in (world, soft))
    assert soft_edge < 0.2 * hard_edge


def test_a_polished_rod_mirrors_the_ball_beside_it() -> None:
    world = plain_world(Lamp(UP, 0.01, 1.0))
    polished = Material(0.0, 0.01, 0.8, 0.0)
    rod = Cylinder(np.array([1.6, -5, -1], np.float32), unit(0, 1, 0), 10.0, 0.5, polished)
    facing = np.array(
        [[1.6 - 0.5 * np.sin(np.pi / 5)]], np.float32
    )  # reflects to the side, where the ball is
    away = np.array([[1.6 + 0.5 * np.sin(np.pi / 5)]], np.float32)
    metal = replace(world, cylinders=(rod,))
    assert trace(metal, facing, 0 * facing)[0][0, 0] < 0.5 * trace(metal, away, 0 * away)[0][0, 0]
