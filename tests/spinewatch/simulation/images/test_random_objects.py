import numpy as np
import pytest

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
from spinewatch.simulation.images.textures import random_textures
from spinewatch.simulation.images.world import Material

BLACK = Material(0.0, 0.05, 0.04, 0.0)


def test_paint_is_dark_and_from_polished_to_matte() -> None:
    rng = np.random.default_rng(0)
    paints = [random_paint(rng) for _ in range(400)]
    roughness = np.array([paint.roughness for paint in paints])
    assert all(paint.albedo <= 0.12 for paint in paints)
    assert all(paint.albedo <= 0.04 for paint in paints if paint.roughness < 0.12)
    assert roughness.min() < 0.05
    assert 0.15 < np.mean(roughness > 0.4) < 0.5


def test_metal_reflects_more_than_paint_or_is_dull() -> None:
    rng = np.random.default_rng(1)
    metals = [random_metal(rng) for _ in range(200)]
    polished = [metal for metal in metals if metal.f0 > 0.45 and metal.roughness < 0.08]
    assert 20 < len(polished) < 90
    assert all(0 < metal.f0 < 1 and 0 <= metal.albedo < 0.5 for metal in metals)


def test_smears_are_from_spots_to_almost_everything() -> None:
    rng = np.random.default_rng(2)
    textures = random_textures(rng, 4, 32)
    smears = [random_smear(rng, textures) for _ in range(200)]
    covers = np.array([np.mean(smear.texture > smear.level + smear.thinness / 2) for smear in smears])
    assert covers.min() < 0.1
    assert covers.max() > 0.8


def test_legs_start_at_the_ball_and_at_the_end_of_each_other() -> None:
    rng = np.random.default_rng(3)
    centre = np.array([1.0, 2.0, 3.0])
    legs = [random_legs(rng, centre, BLACK) for _ in range(50)]
    assert {len(each) for each in legs} == {1, 2}
    for own, *rest in legs:
        assert own.start == pytest.approx(centre)
        for other in rest:
            assert other.start == pytest.approx(own.start + own.length * own.direction, abs=1e-5)


def test_a_rod_passes_the_ball_on_both_sides() -> None:
    rng = np.random.default_rng(4)
    for _ in range(50):
        rod = random_rod(rng, depth=5.0)
        nearest = float(-rod.start @ rod.direction)
        assert 0 < nearest < rod.length
        assert 0.4 <= rod.radius <= 0.9


def test_a_finger_ends_in_a_sphere_of_its_radius() -> None:
    rng = np.random.default_rng(5)
    for _ in range(50):
        finger, end = random_finger(rng)
        assert end.radius == finger.radius
        assert end.centre == pytest.approx(finger.start)
        assert end.material.albedo > 0.14


def test_a_decoy_differs_from_a_ball_in_size_or_place() -> None:
    rng = np.random.default_rng(6)
    for _ in range(100):
        decoy = random_decoy(rng, BLACK)
        assert not 0.7 < decoy.radius < 1.5 or np.hypot(*decoy.centre[:2]) >= 0.8


def test_a_lump_is_beside_the_ball_s_centre() -> None:
    rng = np.random.default_rng(7)
    for _ in range(100):
        lump = random_lump(rng, albedo=0.2)
        assert np.hypot(*lump.centre[:2]) > lump.radius
        assert lump.material.albedo <= 0.9
