"""The thesis's own motion of a triad (eq. 6.1), kept by name to reproduce Table 6.1.

It knows the normals only: the twist about the normal is lost, angles fold at 90 degrees, and the offset of a
body from its triad is carried along without being turned. Measure with ``motion`` instead.
"""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector


def normal_from_angles(angles_deg: Float) -> Float:
    """Return the unit normal (3,) of its angles (alpha, beta, gamma) with the axes, degrees.

    Printed cosines do not square-sum to 1 within rounding, so that they are normalised.
    """
    cosines = np.cos(np.radians(angles_deg))
    return np.asarray(cosines / np.linalg.norm(cosines))


def axis_and_angle(before: Float, after: Float) -> tuple[Float, float]:
    """Return the axis T0 x T1 (3,) and the angle in degrees, at most 90, between two normals (eq. 6.1).

    Parallel normals give a zero axis.
    """
    across = np.cross(before, after)
    sine = float(np.linalg.norm(across) / (np.linalg.norm(before) * np.linalg.norm(after)))
    axis = across / np.linalg.norm(across) if sine > 0 else across
    return axis, float(np.degrees(np.arcsin(min(sine, 1.0))))


def move_body(
    body_mm: Float,
    body_axis: Float,
    triad_before_mm: Float,
    triad_after_mm: Float,
    before: Float,
    after: Float,
) -> tuple[Float, Float]:
    """Return a vertebral body's new position (3,) and axis (3,) as section 6.2 moves them with its triad.

    The axis turns with the normal; the offset from the triad is kept as it was.
    """
    axis, angle = axis_and_angle(before, after)
    R = rotation_from_vector(axis * np.radians(angle))
    return triad_after_mm + (body_mm - triad_before_mm), np.asarray(R @ body_axis)
