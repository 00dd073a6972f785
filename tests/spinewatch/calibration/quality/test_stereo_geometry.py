import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.calibration.quality.stereo_geometry import (
    common_field_mm,
    depth_of_field_mm,
    stereo_geometry,
)
from spinewatch.calibration.solve.orientation import object_to_camera, with_orientation
from spinewatch.camera import Rig
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.geometry.transforms import RigidTransform
from spinewatch.simulation.rigs import perturbed_rig
from tests.spinewatch.calibration.simulated import FIELD, TABLE_3_3, TYPICAL

CONTROL = FIELD.take(TYPICAL)
seeds = st.integers(0, 2**32 - 1)


def test_the_geometry_of_table_3_3() -> None:
    geometry = stereo_geometry(TABLE_3_3, CONTROL)
    assert geometry.baseline_mm == pytest.approx(422, abs=0.5)
    assert geometry.vergence_deg == pytest.approx(32.2, abs=0.1)
    assert np.isnan(geometry.baseline_sd_mm)
    assert geometry.range_mm[0] == pytest.approx(TABLE_3_3.left.depth_mm(CONTROL.mean(axis=0)))
    near, far = geometry.depth_of_field_mm
    assert near < min(geometry.range_mm) < max(geometry.range_mm) < far


@given(seeds)
@settings(max_examples=10, deadline=None)
def test_it_does_not_depend_on_object_space(seed: int) -> None:
    rng = np.random.default_rng(seed)
    motion = RigidTransform(rotation_from_vector(rng.normal(0, 1, 3)), rng.normal(0, 300, 3))
    left, right = (
        with_orientation(c, object_to_camera(c) @ motion.inverse()) for c in (TABLE_3_3.left, TABLE_3_3.right)
    )
    a, b = (
        stereo_geometry(rig, X)
        for rig, X in ((TABLE_3_3, CONTROL), (Rig("moved", left, right), motion(CONTROL)))
    )
    assert b.baseline_mm == pytest.approx(a.baseline_mm)
    assert b.vergence_deg == pytest.approx(a.vergence_deg)
    assert b.range_mm == pytest.approx(a.range_mm)
    assert b.control_depth_mm == pytest.approx(a.control_depth_mm)
    assert b.field_of_view_mm == pytest.approx(a.field_of_view_mm, abs=2)


def test_standard_deviations_are_those_of_the_samples() -> None:
    rng = np.random.default_rng(0)
    samples = [perturbed_rig(TABLE_3_3, rng, 0.1, 1.0) for _ in range(40)]
    geometry = stereo_geometry(TABLE_3_3, CONTROL, samples)
    assert geometry.baseline_sd_mm == pytest.approx(np.std([r.baseline_mm for r in samples]))
    assert geometry.vergence_sd_deg > 0


@given(st.floats(300, 1500), st.floats(1.4, 16))
def test_the_depth_of_field_has_a_blur_of_one_pixel_at_its_limits(focus_mm: float, f_number: float) -> None:
    camera = TABLE_3_3.left
    f, pixel = camera.focal_length_mm, camera.pixel_size_mm[0]
    limits = depth_of_field_mm(camera, focus_mm, f_number)
    in_focus = f * focus_mm / (focus_mm - f)
    for limit in limits:
        image_distance = f if np.isinf(limit) else f * limit / (limit - f)
        blur = f / f_number * abs(image_distance - in_focus) / image_distance
        if np.isfinite(limit):
            assert blur == pytest.approx(pixel, rel=1e-6)
        else:
            assert blur <= pixel * (1 + 1e-6)


def test_the_corners_of_the_common_field_are_near_the_border_of_an_image() -> None:
    centre = CONTROL.mean(axis=0)
    axis = TABLE_3_3.left.M[2] + TABLE_3_3.right.M[2]
    axis /= np.linalg.norm(axis)
    width, height = common_field_mm(TABLE_3_3, centre, axis)
    assert 100 < height < 500
    assert 100 < width < 600
    far_rig = Rig("none", TABLE_3_3.left, with_orientation(TABLE_3_3.right, object_to_camera(TABLE_3_3.left)))
    assert common_field_mm(far_rig, centre, TABLE_3_3.left.M[2])[0] >= width
