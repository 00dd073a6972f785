import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.calibration.errors import PointsError
from spinewatch.calibration.points import ImagePoints, Sensor, check_consistent, flatness
from spinewatch.geometry.rotations import rotation_from_vector
from tests.spinewatch.calibration.simulated import TABLE_3_3, TYPICAL, image

seeds = st.integers(0, 2**32 - 1)


def test_the_sensor_of_a_camera_makes_cameras_with_the_same_plate() -> None:
    sensor = Sensor.of_camera(TABLE_3_3.left)
    assert sensor == Sensor.of_cart((568, 416))
    assert sensor.plate_mm == pytest.approx([5.68, 3.5152])
    assert Sensor.of_camera(sensor.camera(focal_length_mm=8.0)) == sensor


def test_not_a_number_and_duplicates_are_refused() -> None:
    X, U = np.arange(21.0).reshape(7, 3), np.arange(14.0).reshape(7, 2)
    ids = list("abcdefg")
    with pytest.raises(PointsError, match="point c"):
        ImagePoints.build(ids, np.where(np.arange(7)[:, None] == 2, np.nan, X), U)
    with pytest.raises(PointsError, match="twice"):
        ImagePoints.build([*ids[:6], "a"], X, U)
    with pytest.raises(PointsError, match="same pixel"):
        ImagePoints.build(ids, X, U[[0, 1, 2, 3, 4, 5, 5]])


def test_points_that_are_kept_stay_in_order() -> None:
    points = image(TABLE_3_3.left)
    kept = points.keep(np.arange(12) % 3 == 1)
    assert kept.ids == TYPICAL[1::3]
    assert np.array_equal(kept.pixels, points.pixels[1::3])


@given(seeds, st.floats(0.001, 1.0))
def test_flatness_is_that_of_a_box_in_any_orientation(seed: int, depth: float) -> None:
    corners = np.stack(np.meshgrid([-1, 1], [-1, 1], [-depth, depth]), axis=-1).reshape(-1, 3)
    R = rotation_from_vector(np.random.default_rng(seed).uniform(-1, 1, 3))
    assert flatness(corners @ R.T + 7) == pytest.approx(depth, rel=1e-6)


def test_object_coordinates_that_differ_between_images_are_refused() -> None:
    a = image(TABLE_3_3.left)
    b = ImagePoints.build(a.ids, a.control_mm + 1.0, a.pixels)
    check_consistent([("a", a), ("again", a)])
    with pytest.raises(PointsError, match="in b than in a"):
        check_consistent([("a", a), ("b", b)])
