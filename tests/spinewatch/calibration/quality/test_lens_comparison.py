"""A lens is told from another by distortion and aspect, whatever its orientation and focal length."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spinewatch.calibration.control_field import pegboard_1995
from spinewatch.calibration.from_images import calibrate_from_points
from spinewatch.calibration.points import ImagePoints, Sensor, Shot
from spinewatch.calibration.quality.lens_comparison import compare_lenses, lens_flags
from spinewatch.camera import Camera, Rig
from spinewatch.simulation.rigs import large_rig

RIG = large_rig()
ANGLES = st.floats(-20, 20)


def with_left(camera: Camera) -> Rig:
    return Rig("other", camera, RIG.right)


@given(omega=ANGLES, phi=ANGLES, kappa=ANGLES, focal=st.floats(0.98, 1.02))
def test_orientation_and_focal_length_leave_the_shape(
    omega: float, phi: float, kappa: float, focal: float
) -> None:
    camera = RIG.left
    other = replace(camera, rotation_deg=(omega, phi, kappa), focal_length_mm=focal * camera.focal_length_mm)
    difference = compare_lenses(other, camera)
    assert difference.shape_px < 0.1
    assert difference.focal_share == pytest.approx(focal - 1, abs=1e-3)


@pytest.mark.parametrize(
    "changed",
    [
        replace(RIG.left, radial=(-RIG.left.radial[0], 0.0)),
        replace(RIG.left, radial=(0.0, 0.0)),
        replace(RIG.left, pixel_size_mm=(0.01, 0.00845 * 1.01)),
        replace(RIG.left, pixel_size_mm=(0.0101, 0.00845)),
    ],
    ids=["the sign of K1", "without K1", "rows 1% apart", "columns 1% apart"],
)
def test_another_distortion_or_aspect_is_flagged_with_stage_and_side(changed: Camera) -> None:
    (flag,) = lens_flags(with_left(changed), [("PRE", RIG), ("INTER", RIG)])
    assert flag.code == "lens-differs"
    assert "stage INTER" in flag.detail
    assert "left camera by" in flag.detail
    assert "right camera" not in flag.detail


def test_the_latest_stage_that_differs_is_named() -> None:
    other = with_left(replace(RIG.left, radial=(0.0, 0.0)))
    (flag,) = lens_flags(other, [("PRE", RIG), ("INTER", other)])
    assert "stage PRE" in flag.detail


def test_a_shift_of_the_principal_point_is_no_other_lens() -> None:
    x0, y0 = RIG.left.principal_point_mm
    shifted = with_left(replace(RIG.left, principal_point_mm=(x0 + 0.05, y0 - 0.05)))
    assert not list(lens_flags(shifted, [("PRE", RIG)]))


def test_cameras_of_another_image_size_are_not_compared() -> None:
    other = replace(RIG.left, image_size_px=(640, 480), radial=(0.0, 0.0))
    assert not list(lens_flags(with_left(other), [("PRE", RIG)]))


def test_no_earlier_calibration_raises_nothing() -> None:
    assert not list(lens_flags(RIG, []))


def test_sound_calibrations_of_a_lens_do_not_differ() -> None:
    field, rng = pegboard_1995(), np.random.default_rng(5)
    sensors = Sensor.of_camera(RIG.left), Sensor.of_camera(RIG.right)

    def image(camera: Camera) -> ImagePoints:
        pixels = camera.project(field.points_mm)
        inside = np.all((pixels > 8) & (pixels < np.array(camera.image_size_px) - 9), axis=1)
        ids = [id_ for id_, seen in zip(field.ids, inside, strict=True) if seen]
        noise = 0.1 * rng.standard_normal((len(ids), 2))
        return ImagePoints.build(ids, field.points_mm[inside], pixels[inside] + noise)

    found = []
    for _ in range(6):
        shots = [Shot("1", image(RIG.left), image(RIG.right))]
        found.append(calibrate_from_points(shots, field, sensors).calibration.rig)
    for rig in found:
        assert not list(lens_flags(rig, [("PRE", other) for other in found]))
