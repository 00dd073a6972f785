from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.calibration.errors import (
    MirroredFieldError,
    PlanarFieldError,
    TooFewPointsError,
    UndeterminedError,
)
from spinewatch.calibration.points import ImagePoints
from spinewatch.calibration.solve.initial_values import (
    InitialValueParameters,
    focal_length_from_planes,
    initial_cameras,
)
from spinewatch.camera import Camera
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.geometry.transforms import RigidTransform
from tests.spinewatch.calibration.simulated import FIELD, WIDE, WIDE_SENSOR, image

GRID = np.stack([*np.meshgrid(np.arange(6) * 60.0, np.arange(5) * 60.0), np.zeros((5, 6))], -1).reshape(-1, 3)
PINHOLE = WIDE_SENSOR.camera(WIDE.left.position_mm, WIDE.left.rotation_deg, WIDE.left.focal_length_mm)


def plane(camera: Camera, tilt_rad: Sequence[float]) -> ImagePoints:
    """A tilted plane of 30 points at the centre of the field."""
    R = rotation_from_vector(np.array(tilt_rad))
    centre = np.array([317.5, 254.0, 40.0])
    placement = RigidTransform(R, centre - R @ GRID.mean(axis=0))
    return ImagePoints.build([str(i) for i in range(30)], GRID, camera.project(placement(GRID)))


@given(st.floats(0.3, 0.6), st.floats(0.3, 0.6))
@settings(max_examples=15, deadline=None)
def test_tilted_planes_determine_the_focal_length_of_a_centred_camera(a: float, b: float) -> None:
    shots = [plane(PINHOLE, tilt) for tilt in ((a, 0, 0), (0, b, 0), (-a, b, 0.2))]
    found = focal_length_from_planes(shots, WIDE_SENSOR, "the camera")
    assert found == pytest.approx(PINHOLE.focal_length_mm, rel=1e-4)


def test_planes_parallel_to_the_plate_do_not() -> None:
    level = WIDE_SENSOR.camera((317.5, 254.0, 800.0), focal_length_mm=7.0)
    shots = [plane(level, (0, 0, k)) for k in (0.0, 0.3)]
    with pytest.raises(UndeterminedError, match="tilted too little"):
        focal_length_from_planes(shots, WIDE_SENSOR, "the camera")


def test_a_shot_in_relief_gives_the_dlt_first_and_then_what_the_parameters_state() -> None:
    parameters = InitialValueParameters(
        focal_factors=(0.5,), principal_point_shifts=((1.0, 0.0), (0.0, -1.0))
    )
    cameras = initial_cameras([image(WIDE.left, FIELD.ids)], WIDE_SENSOR, "the camera", parameters=parameters)
    f = cameras[0].focal_length_mm
    assert f == pytest.approx(WIDE.left.focal_length_mm, rel=0.01)
    assert [c.focal_length_mm for c in cameras[1:]] == [0.5 * f, f, f]
    width, height = WIDE_SENSOR.plate_mm
    assert cameras[2].principal_point_mm == pytest.approx((width, 0))
    assert cameras[3].principal_point_mm == pytest.approx((0, -height))


def test_a_given_focal_length_is_the_only_one() -> None:
    (camera,) = initial_cameras([image(WIDE.left)], WIDE_SENSOR, "the camera", 7.5)
    assert camera.focal_length_mm == 7.5


def test_shots_of_planes_give_focal_lengths_around_that_of_the_planes() -> None:
    shots = [plane(PINHOLE, tilt) for tilt in ((0.5, 0, 0), (0, 0.5, 0))]
    cameras = initial_cameras(shots, WIDE_SENSOR, "the camera")
    ratios = [c.focal_length_mm / PINHOLE.focal_length_mm for c in cameras]
    assert ratios == pytest.approx([1.0, 0.8, 1.25], rel=1e-3)


def test_what_determines_no_initial_value_is_refused() -> None:
    tilted = plane(PINHOLE, (0.5, 0, 0))
    with pytest.raises(PlanarFieldError, match="the camera"):
        initial_cameras([tilted], WIDE_SENSOR, "the camera")
    with pytest.raises(TooFewPointsError):
        initial_cameras([tilted, tilted.keep(np.arange(30) < 3), tilted], WIDE_SENSOR, "the camera")
    relief = image(WIDE.left, FIELD.ids)
    mirrored = ImagePoints.build(relief.ids, relief.control_mm * (1, -1, 1), relief.pixels)
    with pytest.raises(MirroredFieldError):
        initial_cameras([mirrored], WIDE_SENSOR, "the camera")
