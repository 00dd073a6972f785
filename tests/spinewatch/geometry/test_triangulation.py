from collections.abc import Sequence

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.camera import Camera
from spinewatch.detection.features import Features
from spinewatch.geometry.rays import Rays, nearest_points
from spinewatch.geometry.triangulation import triangulate
from spinewatch.simulation.rigs import converging_rig, random_rig, table_3_3_rig

seeds = st.integers(0, 2**32 - 1)


def rays_to(
    points: Float, cameras: Sequence[Camera], rng: np.random.Generator | None = None, sigma: float = 0.0
) -> list[Rays]:
    noise = rng or np.random.default_rng(0)
    return [
        camera.rays(
            camera.project(points) + sigma * noise.standard_normal((len(points), 2)),
            (sigma or 0.1) ** 2 * np.eye(2),
        )
        for camera in cameras
    ]


def volume(rng: np.random.Generator, n: int) -> Float:
    return rng.uniform((350, 320, 40), (520, 460, 140), (n, 3))


@given(seeds)
def test_exact_rays_meet_in_the_point(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rig, X = random_rig(rng), volume(rng, 10)
    found = triangulate(rays_to(X, (rig.left, rig.right)))
    assert np.abs(found.position_mm - X).max() < 1e-8
    assert found.parallax_mm.max() < 1e-8
    assert found.chi2.max() < 1e-12


def test_the_midpoint_is_half_way_along_the_parallax() -> None:
    rig = table_3_3_rig()
    X = np.array([[430.0, 400.0, 90.0]])
    left, right = rays_to(X, (rig.left, rig.right), np.random.default_rng(3), sigma=2.0)
    point, parallax = nearest_points([left, right])
    nearest = []
    for rays in (left, right):
        d = rays.vectors[0] / np.linalg.norm(rays.vectors[0])
        nearest.append(rays.pinhole.centre_mm + d * (d @ (point[0] - rays.pinhole.centre_mm)))
    assert np.allclose(point[0], np.mean(nearest, axis=0), atol=1e-9)
    assert np.isclose(parallax[0], np.linalg.norm(nearest[0] - nearest[1]))


def test_covariance_is_calibrated() -> None:
    rng = np.random.default_rng(7)
    rig = table_3_3_rig()
    X = np.tile([430.0, 400.0, 90.0], (4000, 1))
    found = triangulate(rays_to(X, (rig.left, rig.right), rng, sigma=0.3))
    miss = found.position_mm - X
    mahalanobis = np.einsum("ni,nij,nj->n", miss, np.linalg.inv(found.covariance_mm2), miss)
    assert abs(mahalanobis.mean() - 3) < 0.15  # chi2 with 3 degrees of freedom, sd of the mean 0.04
    assert abs(found.chi2.mean() - 1) < 0.1


def test_a_third_camera_narrows_the_point() -> None:
    rig = table_3_3_rig()
    third = converging_rig(700.0, 50.0).left
    rng = np.random.default_rng(1)
    X = np.tile([430.0, 400.0, 90.0], (2000, 1))
    two = triangulate(rays_to(X, (rig.left, rig.right), rng, sigma=0.3))
    three = triangulate(rays_to(X, (rig.left, rig.right, third), rng, sigma=0.3))
    assert np.trace(three.covariance_mm2[0]) < np.trace(two.covariance_mm2[0])
    assert three.position_mm.std(axis=0).sum() < two.position_mm.std(axis=0).sum()
    assert abs(three.chi2.mean() - 3) < 0.2  # six observations, three unknowns


def test_parallel_rays_do_not_meet() -> None:
    rig = table_3_3_rig()
    ray = rays_to(np.array([[430.0, 400.0, 90.0]]), (rig.left,))[0]
    point, parallax = nearest_points([ray, ray])
    assert np.isnan(point).all()
    assert np.isnan(parallax).all()


def test_no_rays_give_no_points() -> None:
    rig = table_3_3_rig()
    assert len(triangulate([Features.empty().rays(c) for c in (rig.left, rig.right)]).chi2) == 0
