"""Coordinates of a camera in which least squares runs straight.

Position, rotation, focal length and principal point trade off against each other along curved valleys: a longer
lens from further away, a turned camera with a shifted plate. Seen from the centroid of the control points they
come apart: where the centroid appears on the plate (a, b), the image scale s = f / D there, and the perspective
q = 1 / D, for the distance D of the centroid along the optical axis. These take the places of X0, Y0, f and Z0.
"""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.solve.collinearity import NAMES, turn_axes
from spinewatch.geometry.rotations import rotation_from_angles

_F = NAMES.index("f")


def conditioned(vector: Float, centroid_mm: Float) -> Float:
    """Return the coordinates (14,) of camera parameters (14,)."""
    M = rotation_from_angles(*vector[3:6])
    Tx, Ty, Tz = M @ (centroid_mm - vector[:3])
    f, principal = vector[_F], vector[7:9]
    y = vector.copy()
    y[:2] = np.array([Tx, Ty]) * f / -Tz + principal
    y[2], y[_F] = -1 / Tz, -f / Tz
    return y


def unconditioned(y: Float, centroid_mm: Float, focal_mm: float | None) -> tuple[Float, Float]:
    """Return camera parameters (14,) of coordinates (14,), and their derivatives (14, 14).

    ``focal_mm`` is the focal length where it is not free; the scale then follows from the distance.
    """
    a, b, q = y[:3]
    s = y[_F] if focal_mm is None else focal_mm * q
    M = rotation_from_angles(*y[3:6])
    x, z = (a - y[7]) / s, (b - y[8]) / s
    T = np.array([x, z, -1 / q])
    vector = y.copy()
    vector[:3] = centroid_mm - M.T @ T
    vector[_F] = s / q if focal_mm is None else focal_mm
    J = np.eye(len(y))
    by_scale = M.T @ np.array([x, z, 0.0]) / s
    J[:3, 0], J[:3, 1] = -M[0] / s, -M[1] / s
    J[:3, 7], J[:3, 8] = M[0] / s, M[1] / s
    J[:3, 2], J[:3, _F] = -M[2] / q**2, by_scale
    J[:3, 3:6] = -M.T @ np.cross(turn_axes(y[3:6]), T).T * np.radians(1.0)
    J[_F, _F], J[_F, 2] = 1 / q, -s / q**2
    if focal_mm is not None:
        J[:3, 2] += focal_mm * by_scale
        J[:, _F] = 0.0
        J[_F, :] = 0.0
    return vector, J
