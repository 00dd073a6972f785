from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spinewatch.calibration.errors import MirroredFieldError, PlanarFieldError, TooFewPointsError
from spinewatch.calibration.points import ImagePoints
from spinewatch.calibration.solve.dlt import DltParameters, check_solvable, solve_dlt
from spinewatch.camera import Camera
from spinewatch.simulation.rigs import random_rig
from tests.spinewatch.calibration.simulated import FIELD, SENSOR, TABLE_3_3, TYPICAL, WIDE, WIDE_SENSOR, image

seeds = st.integers(0, 2**32 - 1)


@given(seeds)
@settings(max_examples=15, deadline=None)
def test_the_dlt_is_exact_for_a_camera_with_k1(seed: int) -> None:
    pose = random_rig(np.random.default_rng(seed)).left
    lens = (7.7, (0.03, -0.02), (0.003, 0.0), (0.0, 0.0))
    camera = Camera(pose.position_mm, pose.rotation_deg, *lens, (568, 416), (0.01, 0.00845))
    solved = solve_dlt(image(camera), SENSOR)
    X = FIELD.take(TYPICAL)
    assert np.abs(solved.camera.project(X) - camera.project(X)).max() < 1e-3
    assert abs(solved.aspect - 0.845) < 1e-5


def test_the_eleven_constants_project_like_the_camera() -> None:
    camera = replace(WIDE.left, radial=(0.0, 0.0))
    solved = solve_dlt(image(camera, FIELD.ids), WIDE_SENSOR)
    homogeneous = np.column_stack([FIELD.points_mm, np.ones(30)]) @ solved.L.T
    plate = homogeneous[:, :2] / homogeneous[:, 2:]
    assert np.allclose(camera.pixels(plate), camera.project(FIELD.points_mm), atol=1e-4)
    assert solved.L[2, 3] == pytest.approx(1)


def test_outliers_are_left_out() -> None:
    offsets = np.zeros((30, 2))
    offsets[[4, 11, 25]] = 60.0
    points = image(WIDE.left, FIELD.ids, sigma_px=0.05, offsets_px=offsets)
    error = solve_dlt(points, WIDE_SENSOR).camera.project(FIELD.points_mm) - WIDE.left.project(
        FIELD.points_mm
    )
    assert np.abs(error).max() < 1.0


def test_points_that_do_not_determine_a_camera_are_refused() -> None:
    with pytest.raises(TooFewPointsError, match="the left image has 5 control points"):
        check_solvable(image(TABLE_3_3.left, TYPICAL[:5]), "the left image")
    points = image(WIDE.left, FIELD.ids)
    flat = points.keep(np.isclose(FIELD.points_mm[:, 2], 45, atol=0.4))
    with pytest.raises(PlanarFieldError, match="different heights"):
        solve_dlt(flat, WIDE_SENSOR)
    with pytest.raises(PlanarFieldError):
        check_solvable(points, "the image", DltParameters(min_flatness=0.9))
    mirrored = ImagePoints.build(points.ids, points.control_mm * (1, -1, 1), points.pixels)
    with pytest.raises(MirroredFieldError):
        solve_dlt(mirrored, WIDE_SENSOR)
