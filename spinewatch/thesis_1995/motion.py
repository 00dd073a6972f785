"""The thesis's motion of a triad (eq. 6.1), to reproduce Table 6.1.

It uses normals only: the rotation about the normal is lost, angles above 90 degrees are folded, and the offset of a
body from its triad is not rotated. `spinewatch.spine.motion` replaces it.
"""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector


def normal_from_angles(angles_deg: Float) -> Float:
    """Return the unit normal of its angles with the object axes.

    Parameters
    ----------
    angles_deg
        (alpha, beta, gamma), shape (3,), degrees.

    Returns
    -------
    Float
        Unit normal, shape (3,). The cosines of printed angles are normalized, since rounding changes their norm.

    Examples
    --------
    >>> import numpy as np
    >>> normal_from_angles(np.array([90.0, 60.0, 30.0])).round(3)
    array([0.   , 0.5  , 0.866])
    """
    cosines = np.cos(np.radians(angles_deg))
    return np.asarray(cosines / np.linalg.norm(cosines))


def axis_and_angle(before: Float, after: Float) -> tuple[Float, float]:
    """Return axis and angle of the rotation between two normals.

    Parameters
    ----------
    before, after
        Normals of the triad, shape (3,).

    Returns
    -------
    axis : Float
        Unit vector along ``before x after``, shape (3,); zero for parallel normals.
    angle_deg : float
        Angle, at most 90 degrees.

    References
    ----------
    Thesis eq. 6.1.
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
    """Return position and axis of a vertebral body after a motion of its triad.

    Parameters
    ----------
    body_mm
        Position of the body before, shape (3,), mm.
    body_axis
        Axis of the body before, shape (3,).
    triad_before_mm, triad_after_mm
        Positions of the triad, shape (3,), mm.
    before, after
        Normals of the triad, shape (3,).

    Returns
    -------
    position_mm : Float
        Position of the body after, shape (3,), mm; its offset from the triad is unchanged.
    axis : Float
        Axis of the body after, shape (3,), rotated with the normal.

    References
    ----------
    Thesis section 6.2.
    """
    axis, angle = axis_and_angle(before, after)
    R = rotation_from_vector(axis * np.radians(angle))
    return triad_after_mm + (body_mm - triad_before_mm), np.asarray(R @ body_axis)
