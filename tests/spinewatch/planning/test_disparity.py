import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.errors import ParameterError
from spinewatch.planning.disparity import disparity_grid
from spinewatch.simulation.rigs import large_rig, random_rig, table_3_3_rig


@given(st.integers(0, 2**32 - 1))
def test_disparities_are_those_of_points_between_the_heights(seed: int) -> None:
    rng = np.random.default_rng(seed)
    rig = random_rig(rng)
    grid = disparity_grid(rig, (60.0, 120.0), planes=13, cells=(13, 17))
    X = rng.uniform((400, 370, 65), (470, 410, 115), (20, 3))
    disparity = rig.right.project(X) - rig.left.project(X)
    (u_min, u_max), (v_min, v_max) = grid.bounds_px(2.0)
    assert np.all((disparity >= (u_min, v_min)) & (disparity <= (u_max, v_max)))


def test_each_entry_reprojects_to_one_object_point() -> None:
    rig = large_rig()
    grid = disparity_grid(rig, (60.0, 120.0), planes=3)
    plane, row, column = (int(i[0]) for i in np.nonzero(np.isfinite(grid.disparity_px[..., 0])))
    left = grid.left_px[row, column]
    ray = rig.left.directions(left)
    point = rig.left.centre + (grid.z_mm[plane] - rig.left.centre[2]) / ray[2] * ray
    assert rig.right.project(point) - left == pytest.approx(grid.disparity_px[plane, row, column])


def test_distribution_and_bounds_belong_to_the_same_values() -> None:
    grid = disparity_grid(large_rig(), (60.0, 120.0), planes=5)
    mean, sd = grid.distribution()
    assert mean.shape == sd.shape == (5, 2)
    (u_min, u_max), _ = grid.bounds_px()
    assert u_min < mean[:, 0].min() < mean[:, 0].max() < u_max
    assert grid.bounds_px(3.0)[0] == pytest.approx((u_min - 3, u_max + 3))
    assert np.all(np.diff(mean[:, 0]) < 0)  # nearer planes have less disparity


def test_heights_that_the_images_do_not_share_are_omitted() -> None:
    rig = table_3_3_rig()
    grid = disparity_grid(rig, (0.0, rig.left.centre[2] - 1.0), planes=9)
    assert len(grid.z_mm) < 9
    assert np.isfinite(grid.disparity_px).any(axis=(1, 2, 3)).all()
    with pytest.raises(ParameterError, match="both images"):
        disparity_grid(rig, (5000.0, 6000.0))
