"""Distortion about the origin of the plate, as in 1995, and about the principal point, as here.

The model of 1995 measures r from the origin of the plate. With a principal point elsewhere neither model contains the
other: the nearest camera of the other model is fitted over the image, with its interior orientation and its angles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from spinewatch.arrays import Float
from spinewatch.camera import Camera, undistorted
from spinewatch.geometry.rotations import angles_from_rotation, rotation_from_vector
from spinewatch.rig_plausibility import pixel_grid

_GRID = 21
"""Grid points per side of the image."""


@dataclass(frozen=True, eq=False)
class ConvertedCamera:
    """A camera of the other model.

    Attributes
    ----------
    camera
        Its parameters; what they mean is not what a `Camera` means when they are those of 1995.
    fit_error_px
        Maximum distance of its rays from those of the given camera over the image, px.
    """

    camera: Camera
    fit_error_px: float


def about_principal_point(parameters: Camera) -> ConvertedCamera:
    """Return the camera of parameters whose r is measured from the origin of the plate.

    Parameters
    ----------
    parameters
        Parameters as in Table 3.3.

    Returns
    -------
    ConvertedCamera
        The nearest camera of the model here.

    References
    ----------
    Thesis eqs 3.1 and 3.4, in which r^2 = x^2 + y^2, the radial plate distance.

    Examples
    --------
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> about_principal_point(table_3_3_rig().left).fit_error_px < 0.02
    True
    """
    return _converted(parameters, _undistorted_about_origin, Camera.undistort)


def about_plate_origin(camera: Camera) -> ConvertedCamera:
    """Return the parameters, with r measured from the origin of the plate, of a camera.

    Parameters
    ----------
    camera
        A camera.

    Returns
    -------
    ConvertedCamera
        The nearest parameters as in Table 3.3.

    Examples
    --------
    >>> from spinewatch.simulation.rigs import large_rig
    >>> about_plate_origin(large_rig().left).fit_error_px < 0.02
    True
    """
    return _converted(camera, Camera.undistort, _undistorted_about_origin)


Undistortion = Callable[[Camera, Float], Float]
"""From measured plate points (n, 2) to ideal ones relative to the principal point, mm."""


def _undistorted_about_origin(parameters: Camera, plate_mm: Float) -> Float:
    """Return ideal plate points (n, 2) by the model of 1995."""
    offsets = plate_mm - parameters.principal_point_mm
    r2 = np.sum(plate_mm * plate_mm, axis=1)
    return undistorted(offsets, r2, parameters.radial, parameters.decentering)


def _converted(
    given: Camera, undistort_given: Undistortion, undistort_fitted: Undistortion
) -> ConvertedCamera:
    """Return the camera whose rays in one model are nearest to those of a camera in the other."""
    if not any((*given.radial, *given.decentering)) or not any(given.principal_point_mm):
        return ConvertedCamera(given, 0.0)
    plate = given.plate(pixel_grid(given.image_size_px, _GRID))
    f = given.focal_length_mm
    expected = undistort_given(given, plate)
    corner = float(np.linalg.norm(plate, axis=1).max())
    powers = np.array([1, 1, 1, corner**-2, corner**-4, corner**-1, corner**-1, 1, 1, 1])
    start = np.array([f, *given.principal_point_mm, *given.radial, *given.decentering, 0, 0, 0]) / powers

    def fitted(v: Float) -> tuple[Camera, Float]:
        focal, x0, y0, K1, K2, P1, P2, *rotation = (float(c) for c in v * powers)
        camera = replace(
            given,
            focal_length_mm=focal,
            principal_point_mm=(x0, y0),
            radial=(K1, K2),
            decentering=(P1, P2),
        )
        return camera, rotation_from_vector(np.array(rotation))

    def residuals(v: Float) -> Float:
        camera, turn = fitted(v)
        ideal = undistort_fitted(camera, plate)
        rays = np.column_stack([ideal, np.full(len(ideal), -camera.focal_length_mm)]) @ turn.T
        on_plate = rays[:, :2] * (-f / rays[:, 2:])
        return np.asarray(((on_plate - expected) / given.pixel_size_mm).ravel())

    solution = np.asarray(least_squares(residuals, start, x_scale="jac", xtol=1e-13, ftol=1e-13).x)
    camera, turn = fitted(solution)
    angles = angles_from_rotation(turn.T @ given.M)
    error = np.linalg.norm(residuals(solution).reshape(-1, 2), axis=1).max()
    return ConvertedCamera(replace(camera, rotation_deg=angles), float(error))
