from dataclasses import replace

import numpy as np
import pytest

from spinewatch.camera import Camera
from spinewatch.rig_files.plate_origin import about_plate_origin, about_principal_point
from spinewatch.simulation.rigs import table_3_3_rig

PRINTED = table_3_3_rig().left
"""The left camera of Table 3.3, read as if r were from the principal point."""


def published_ray(parameters: Camera, pixel: tuple[float, float]) -> np.ndarray:
    """The direction of a pixel in object space by eqs 3.1 and 3.4, for K1 alone."""
    x, y = parameters.plate(pixel)
    x0, y0 = parameters.principal_point_mm
    factor = 1 + parameters.radial[0] * (x * x + y * y)
    ray = parameters.M.T @ np.array([(x - x0) * factor, (y - y0) * factor, -parameters.focal_length_mm])
    return np.asarray(ray / np.linalg.norm(ray))


@pytest.mark.parametrize("pixel", [(0.0, 415.0), (567.0, 0.0), (283.5, 207.5), (567.0, 415.0), (30.0, 300.0)])
def test_the_rays_are_those_of_the_published_equations(pixel: tuple[float, float]) -> None:
    parameters = replace(PRINTED, radial=(PRINTED.radial[0], 0.0), decentering=(0.0, 0.0))
    converted = about_principal_point(parameters)
    expected = published_ray(parameters, pixel)
    again = converted.camera.project(parameters.centre + 700 * expected)
    assert np.linalg.norm(again - pixel) <= converted.fit_error_px + 1e-3
    assert converted.fit_error_px < 0.02
    as_read = parameters.project(parameters.centre + 700 * expected)
    if pixel == (0.0, 415.0):
        assert np.linalg.norm(as_read - pixel) > 0.3  # what reading r from the principal point would cost


def test_a_principal_point_at_the_origin_changes_nothing() -> None:
    camera = replace(PRINTED, principal_point_mm=(0.0, 0.0))
    assert about_principal_point(camera).camera == camera
    assert about_plate_origin(camera).fit_error_px == 0


def test_a_strong_distortion_states_its_error() -> None:
    strong = replace(PRINTED, radial=(0.02, 2e-3), principal_point_mm=(0.4, -0.3))
    assert about_principal_point(strong).fit_error_px > 0.05
