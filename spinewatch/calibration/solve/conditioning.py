"""Coordinates of a camera in which least squares converges along nearly straight lines.

Position, rotation, focal length and principal point are correlated: a longer lens at a larger distance, or a rotated
camera with a shifted plate, give nearly the same image. With respect to the centroid of the control points these
correlations nearly vanish. The coordinates are the image (a, b) of the centroid on the plate, the image scale
s = f / D and the perspective q = 1 / D, where D is the distance of the centroid along the optical axis. They replace
X0, Y0, f and Z0.
"""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.solve.collinearity import PARAMETER_NAMES, rotation_axes
from spinewatch.geometry.rotations import rotation_from_angles

_F = PARAMETER_NAMES.index("f")


def conditioned(vector: Float, centroid_mm: Float) -> Float:
    """Return the conditioned coordinates of a camera.

    Parameters
    ----------
    vector
        Camera parameters in the order of `PARAMETER_NAMES`, shape (14,).
    centroid_mm
        Centroid of the control points, shape (3,), object space, mm.

    Returns
    -------
    Float
        The same vector with (a, b, q) instead of (X0, Y0, Z0) and s instead of f, shape (14,).
    """
    M = rotation_from_angles(*vector[3:6])
    Tx, Ty, Tz = M @ (centroid_mm - vector[:3])
    f, principal = vector[_F], vector[7:9]
    y = vector.copy()
    y[:2] = np.array([Tx, Ty]) * f / -Tz + principal
    y[2], y[_F] = -1 / Tz, -f / Tz
    return y


def unconditioned(y: Float, centroid_mm: Float, focal_length_mm: float | None) -> tuple[Float, Float]:
    """Return the camera parameters of conditioned coordinates, the inverse of `conditioned`.

    Parameters
    ----------
    y
        Conditioned coordinates, shape (14,).
    centroid_mm
        Centroid of the control points, shape (3,), object space, mm.
    focal_length_mm
        f when it is not adjusted, mm; the scale then follows from the distance. None when f is adjusted.

    Returns
    -------
    vector : Float
        Camera parameters in the order of `PARAMETER_NAMES`, shape (14,).
    jacobian : Float
        Derivatives of the parameters with respect to the coordinates, shape (14, 14).

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.calibration.solve.collinearity import camera_vector
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> vector, centroid = camera_vector(table_3_3_rig().left), np.array([400.0, 380.0, 50.0])
    >>> back, _ = unconditioned(conditioned(vector, centroid), centroid, None)
    >>> bool(np.allclose(back, vector))
    True
    """
    a, b, q = y[:3]
    s = y[_F] if focal_length_mm is None else focal_length_mm * q
    M = rotation_from_angles(*y[3:6])
    x, z = (a - y[7]) / s, (b - y[8]) / s
    T = np.array([x, z, -1 / q])
    vector = y.copy()
    vector[:3] = centroid_mm - M.T @ T
    vector[_F] = s / q if focal_length_mm is None else focal_length_mm
    J = np.eye(len(y))
    by_scale = M.T @ np.array([x, z, 0.0]) / s
    J[:3, 0], J[:3, 1] = -M[0] / s, -M[1] / s
    J[:3, 7], J[:3, 8] = M[0] / s, M[1] / s
    J[:3, 2], J[:3, _F] = -M[2] / q**2, by_scale
    J[:3, 3:6] = -M.T @ np.cross(rotation_axes(y[3:6]), T).T * np.radians(1.0)
    J[_F, _F], J[_F, 2] = 1 / q, -s / q**2
    if focal_length_mm is not None:
        J[:3, 2] += focal_length_mm * by_scale
        J[:, _F] = 0.0
        J[_F, :] = 0.0
    return vector, J
