"""Patient axes in object space: x anterior, y left, z cephalad."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.errors import ParameterError


class PatientAxesError(ParameterError):
    """Directions or landmarks that do not determine the patient's axes."""

    code = "invalid-patient-axes"


@dataclass(frozen=True)
class PatientAxesParameters:
    """What directions must fulfil.

    Attributes
    ----------
    min_angle_deg
        Least angle between cephalad and left, or between either and the opposite of the other, degrees. A direction
        that is read by eye is good to some 5 degrees, which this angle must exceed.
    min_distance_mm
        Least distance between landmarks, mm.
    """

    min_angle_deg: float = 10.0
    min_distance_mm: float = 10.0


def axes_from_directions(
    cephalad: Float, left: Float, parameters: PatientAxesParameters | None = None
) -> Float:
    """Return the patient axes of two directions; cephalad is kept, left is made perpendicular to it.

    Parameters
    ----------
    cephalad, left
        Directions to the head and to the patient's left in object space, shape (3,), of any length.
    parameters
        What they must fulfil.

    Returns
    -------
    Float
        Rotation from patient to object axes, shape (3, 3); columns are the anterior, left and cephalad directions.

    Raises
    ------
    PatientAxesError
        If a direction is not finite or zero, or the two are nearly parallel.

    References
    ----------
    Axes of ISO 2631 and of Stokes, Spine 19 (1994) 236; Gram-Schmidt.

    Examples
    --------
    >>> import numpy as np
    >>> axes_from_directions(np.array([-2.0, 0, 0]), np.array([0.1, -1.0, 0])).round(9) + 0.0
    array([[ 0.,  0., -1.],
           [ 0., -1.,  0.],
           [-1.,  0.,  0.]])
    """
    parameters = parameters or PatientAxesParameters()
    z, y = _unit(cephalad, "cephalad"), _unit(left, "left")
    angle = float(np.degrees(np.arctan2(np.linalg.norm(np.cross(z, y)), abs(z @ y))))
    if angle < parameters.min_angle_deg:
        raise PatientAxesError(
            f"cephalad and left are {angle:.1f} degrees from parallel; give directions at least"
            f" {parameters.min_angle_deg:g} degrees apart, nearly perpendicular"
        )
    y = y - (y @ z) * z
    y /= np.linalg.norm(y)
    return np.stack([np.cross(y, z), y, z], axis=1)


def axes_from_landmarks(
    caudal_mm: Float, cephalad_mm: Float, left_mm: Float, parameters: PatientAxesParameters | None = None
) -> Float:
    """Return the patient axes of three landmarks.

    Parameters
    ----------
    caudal_mm, cephalad_mm
        Two points on the midline, shape (3,), object space, mm; the second nearer the head.
    left_mm
        A point to the patient's left of the midline, shape (3,), object space, mm.
    parameters
        What they must fulfil.

    Returns
    -------
    Float
        Rotation from patient to object axes, shape (3, 3); cephalad is along the midline.

    Raises
    ------
    PatientAxesError
        If a point is not finite, two of them nearly coincide, or all are nearly on a line.

    Examples
    --------
    >>> import numpy as np
    >>> caudal, cephalad, left = np.array([[0.0, 0, 0], [0, 0, 400], [0, 100, 350]])
    >>> axes_from_landmarks(caudal, cephalad, left)
    array([[1., 0., 0.],
           [0., 1., 0.],
           [0., 0., 1.]])
    """
    parameters = parameters or PatientAxesParameters()
    points = {"caudal": caudal_mm, "cephalad": cephalad_mm, "left": left_mm}
    for first, second in (("caudal", "cephalad"), ("caudal", "left"), ("cephalad", "left")):
        distance = float(np.linalg.norm(np.asarray(points[first]) - points[second]))
        if not distance >= parameters.min_distance_mm:
            raise PatientAxesError(
                f"landmarks {first} and {second} are {distance:.1f} mm apart; choose points at least"
                f" {parameters.min_distance_mm:g} mm apart"
            )
    middle = (np.asarray(caudal_mm) + cephalad_mm) / 2
    try:
        return axes_from_directions(np.asarray(cephalad_mm) - caudal_mm, left_mm - middle, parameters)
    except PatientAxesError as error:
        raise PatientAxesError(
            f"the three landmarks are nearly on a line ({error}); choose the left one farther from the midline"
        ) from error


def _unit(direction: Float, name: str) -> Float:
    """Return a direction of unit length, or say what is wrong with it."""
    direction = np.asarray(direction, dtype=float)
    length = float(np.linalg.norm(direction))
    if direction.shape != (3,) or not np.isfinite(length) or length == 0:
        raise PatientAxesError(f"{name} is not a direction; give three finite numbers that are not all zero")
    return np.asarray(direction / length)
