import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.arrays import Single
from spinewatch.simulation.images.world import Cylinder, Material, Sphere

BLACK = Material(0.0, 0.05, 0.04, 0.0)
LINE = np.linspace(-4, 4, 81, dtype=np.float32)
X, Y = np.meshgrid(LINE, LINE[::-1])


def vector(x: float, y: float, z: float) -> Single:
    return np.array([x, y, z], np.float32)


coordinates = st.floats(-2, 2)


@given(coordinates, coordinates, coordinates, st.floats(0.3, 2))
def test_a_sphere_is_hit_on_its_upper_half(x: float, y: float, z: float, radius: float) -> None:
    hit = Sphere(vector(x, y, z), radius, BLACK).hit(X, Y)
    assert hit is not None
    offset = np.stack([X[hit.inside], Y[hit.inside], hit.z]) - vector(x, y, z)[:, None]
    assert np.abs(np.linalg.norm(offset, axis=0) - radius).max() < 1e-3
    assert np.abs(offset / radius - hit.normal).max() < 1e-3
    assert np.all(hit.normal[2] >= 0)


@given(coordinates, coordinates, coordinates, st.floats(0, 2 * np.pi), st.floats(0.4, np.pi - 0.4))
def test_a_cylinder_is_hit_on_its_side_towards_the_camera(
    x: float, y: float, z: float, azimuth: float, from_z: float
) -> None:
    direction = vector(np.sin(from_z) * np.cos(azimuth), np.sin(from_z) * np.sin(azimuth), np.cos(from_z))
    cylinder = Cylinder(vector(x, y, z), direction, 3.0, 0.4, BLACK)
    hit = cylinder.hit(X, Y)
    assert hit is not None
    offset = np.stack([X[hit.inside], Y[hit.inside], hit.z]) - cylinder.start[:, None]
    along = direction @ offset
    across = offset - along * direction[:, None]
    assert np.abs(np.linalg.norm(across, axis=0) - cylinder.radius).max() < 1e-3
    assert np.abs(across / cylinder.radius - hit.normal).max() < 5e-3
    assert along.min() > -1e-3
    assert along.max() < cylinder.length + 1e-3
    assert np.all(hit.normal[2] >= 0)


def test_rays_beside_a_surface_miss_it() -> None:
    assert Sphere(vector(9, 0, 0), 1.0, BLACK).hit(X, Y) is None
    assert Cylinder(vector(9, 0, 0), vector(1, 0, 0), 3.0, 0.4, BLACK).hit(X, Y) is None


def test_a_cylinder_along_the_viewing_direction_is_not_drawn() -> None:
    assert Cylinder(vector(0, 0, 0), vector(0, 0, 1), 3.0, 0.4, BLACK).hit(X, Y) is None


def test_the_silhouette_of_a_sphere_is_a_disc() -> None:
    hit = Sphere(vector(0, 0, 0), 2.0, BLACK).hit(X, Y)
    assert hit is not None
    assert hit.inside.sum() * (LINE[1] - LINE[0]) ** 2 == pytest.approx(4 * np.pi, rel=0.02)
