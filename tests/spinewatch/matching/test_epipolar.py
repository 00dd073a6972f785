from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.arrays import Float
from spinewatch.camera import Camera, Rig
from spinewatch.errors import ParameterError
from spinewatch.geometry.rays import Rays
from spinewatch.matching.epipolar import (
    EpipolarParameters,
    candidate_pairs,
    close_far_points,
    epipolar_distance_mrad,
    epipolar_distance_sigma,
    epipolar_segments,
    range_limits_mm,
)
from spinewatch.planning.disparity import disparity_grid
from spinewatch.simulation.rigs import converging_rig, random_rig, table_3_3_rig

seeds = st.integers(0, 2**32 - 1)
PARAMETERS = EpipolarParameters()


def rays(camera: Camera, pixels: Float, sigma: float = 0.3) -> Rays:
    pixels = np.atleast_2d(pixels)
    return camera.rays(pixels, sigma**2 * np.eye(2))


def volume(rng: np.random.Generator, n: int) -> Float:
    return rng.uniform((350, 320, 40), (520, 460, 140), (n, 3))


@settings(deadline=None)
@given(seeds)
def test_every_true_pair_is_a_candidate_both_ways(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rig, X = random_rig(rng), volume(rng, 15)
    pairs = candidate_pairs(
        rays(rig.left, rig.left.project(X)), rays(rig.right, rig.right.project(X)), rig, PARAMETERS
    )
    assert {(i, i) for i in range(15)} <= set(zip(pairs.left.tolist(), pairs.right.tolist(), strict=True))


@settings(deadline=None)
@given(seeds)
def test_close_and_far_points_lie_on_the_ray_at_their_range(seed: int) -> None:
    rng = np.random.default_rng(seed)
    camera = random_rig(rng).left
    pixels = rng.uniform((0, 0), camera.image_size_px, (5, 2))
    ends = close_far_points(rays(camera, pixels), np.array([500.0, 900.0]))
    assert np.allclose(((ends - camera.centre) @ camera.M.T)[..., 2], [-500, -900])
    assert np.abs(camera.project(ends) - pixels[:, None]).max() < 1e-9


@settings(deadline=None)
@given(seeds)
def test_images_of_a_ray_lie_on_its_epipolar_segment_for_any_lens(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rig = random_rig(rng)
    left = rays(rig.left, rng.uniform((150, 100), (400, 300)))
    ends = epipolar_segments(left, rig.right.pinhole, np.array([500.0, 900.0]))[0]
    between = close_far_points(left, np.linspace(500, 900, 9))[0]
    ideal = rig.right.undistort(rig.right.plate(rig.right.project(between)))
    along = ends[1] - ends[0]
    offset = np.cross(np.append(along, 0), np.column_stack([ideal - ends[0], np.zeros(9)]))[:, 2]
    assert np.abs(offset / np.linalg.norm(along)).max() < 1e-9
    assert np.allclose(ideal[[0, -1]], ends, atol=1e-9)


def test_the_distance_is_in_its_own_standard_deviations() -> None:
    rng = np.random.default_rng(5)
    rig, n, sigma = table_3_3_rig(), 300, 0.4
    X = volume(rng, n)
    left = rays(rig.left, rig.left.project(X) + sigma * rng.standard_normal((n, 2)), sigma)
    right = rays(rig.right, rig.right.project(X) + sigma * rng.standard_normal((n, 2)), sigma)
    z = np.diag(epipolar_distance_sigma(left, right))
    assert abs(z.std() - 1) < 0.12
    assert np.allclose(epipolar_distance_sigma(right, left).T, epipolar_distance_sigma(left, right))


def test_the_distance_in_mrad_is_that_from_the_epipolar_line_in_the_right_image() -> None:
    rng = np.random.default_rng(6)
    rig, X = table_3_3_rig(), volume(rng, 8)
    left, right = (rays(c, c.project(X)) for c in (rig.left, rig.right))
    distance, inside = epipolar_distance_mrad(left, right, rig, PARAMETERS)
    assert np.diag(inside).all()
    assert np.abs(np.diag(distance)).max() < 1e-6
    ends = epipolar_segments(left, rig.right.pinhole, range_limits_mm(rig, PARAMETERS)[0])
    along = (ends[:, 1] - ends[:, 0]) / np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1, keepdims=True)
    gap = right.ideal_mm - ends[:, :1]
    across = gap[..., 0] * along[:, None, 1] - gap[..., 1] * along[:, None, 0]
    assert np.allclose(np.abs(distance), np.abs(across) / rig.right.focal_length_mm * 1000, atol=1e-6)


def test_a_feature_off_the_line_or_beyond_the_range_is_no_candidate() -> None:
    rig = table_3_3_rig()
    X = np.array([[430.0, 400.0, 90.0]])
    left = rays(rig.left, rig.left.project(X))

    def accepted(point: Float, shift: tuple[float, float] = (0.0, 0.0)) -> bool:
        right = rays(rig.right, rig.right.project(point) + shift)
        return len(candidate_pairs(left, right, rig, PARAMETERS).left) == 1

    ray = rig.left.directions(rig.left.project(X))[0]
    assert accepted(X)
    assert accepted(X, (0.0, 0.5))
    assert not accepted(X, (0.0, 4.0))
    assert not accepted(rig.left.centre + 450 * ray)
    assert not accepted(rig.left.centre + 1000 * ray)


def test_the_range_limits_are_fractions_of_the_range_of_the_convergence_point() -> None:
    rig = converging_rig(420, 32)
    near, far = PARAMETERS.range_fractions
    aimed = np.linalg.norm(rig.left.centre - [434, 390, 90])
    for limits in range_limits_mm(rig, PARAMETERS):
        assert np.allclose(limits, (near * aimed, far * aimed))


def test_parallel_cameras_need_a_range() -> None:
    rig = table_3_3_rig()
    parallel = Rig("parallel", rig.left, replace(rig.right, rotation_deg=rig.left.rotation_deg))
    with pytest.raises(ParameterError, match="range"):
        range_limits_mm(parallel, PARAMETERS)
    left, right = range_limits_mm(parallel, replace(PARAMETERS, range_mm=(500, 900)))
    assert left.tolist() == right.tolist() == [500, 900]


def v_px(camera: Camera, rays: Rays) -> Float:
    return camera.pixels(camera.distort(rays.ideal_mm))[:, 1]


@given(seeds)
@settings(max_examples=20, deadline=None)
def test_the_range_limits_imply_the_bound_of_the_disparity_grid(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rig = random_rig(rng)
    left, right = (rays(c, rng.uniform((0, 0), (567, 415), (60, 2))) for c in (rig.left, rig.right))
    heights = close_far_points(left, range_limits_mm(rig, PARAMETERS)[0])[..., 2]
    _, bound = disparity_grid(rig, (heights.min(), heights.max()), planes=15, cells=(15, 15)).bounds_px(2.0)
    pairs = candidate_pairs(left, right, rig, PARAMETERS)
    disparity = v_px(rig.right, right)[pairs.right] - v_px(rig.left, left)[pairs.left]
    assert np.all((disparity >= bound[0]) & (disparity <= bound[1]))
    assert bound[1] - bound[0] < 416 / 2  # the bound is useful
