"""Patient axes in object space: x anterior, y left, z cephalad."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.errors import ParameterError
from spinewatch.levels import level_numbers
from spinewatch.triads.pose import Pose


class PatientAxesError(ParameterError):
    """Directions or landmarks that do not determine the patient's axes."""

    code = "invalid-patient-axes"


class PatientAxesContradictedError(ParameterError):
    """Patient axes that the labelled triads or the given vertebrae contradict."""

    code = "patient-axes-contradicted"


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
    max_chain_angle_deg
        Greatest angle between the cephalad axis and the line from the most caudal to the most cranial vertebra,
        degrees; a wrong axis of object space is off by 90 or 180.
    chain_tolerance_mm
        How far beyond that angle the line may end, mm. Between neighbours, lordosis and the different places of their
        triads turn it by up to 65 degrees.
    min_front_angle_deg
        Least angle between the anterior axis and the mean normal of the triads, degrees. Triads stand behind the spine
        and face the cameras, so that 180 is usual; left and right exchanged reverse the anterior axis.
    """

    min_angle_deg: float = 10.0
    min_distance_mm: float = 10.0
    max_chain_angle_deg: float = 45.0
    chain_tolerance_mm: float = 20.0
    min_front_angle_deg: float = 60.0


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


def require_axes_of_triads(
    patient_axes: Float,
    triads: Mapping[str, Pose],
    extra_levels: Sequence[str] = (),
    parameters: PatientAxesParameters | None = None,
) -> None:
    """Refuse patient axes that labelled triads contradict.

    Parameters
    ----------
    patient_axes
        Rotation from patient to object axes, shape (3, 3).
    triads
        Poses of the triads at the baseline stage by vertebra, object space.
    extra_levels
        Vertebrae that this spine has in addition.
    parameters
        What axes must fulfil.

    Raises
    ------
    PatientAxesContradictedError
        If the triads do not run along the cephalad axis, or face the way of the anterior axis. One triad shows no
        direction of the spine, and is only tested for the latter.
    LevelError
        If the name of a vertebra is unknown.

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.geometry.rotations import rotation_from_vector
    >>> behind = rotation_from_vector(np.array([0.0, -np.pi / 2, 0.0]))
    >>> triads = {n: Pose(np.array([-45.0, 0, z]), behind, np.zeros((6, 6))) for n, z in (("L1", 0.0), ("T12", 30.0))}
    >>> require_axes_of_triads(np.eye(3), triads)
    >>> require_axes_of_triads(np.diag([1.0, -1.0, -1.0]), triads)
    Traceback (most recent call last):
    spinewatch.spine.patient_axes.PatientAxesContradictedError: cephalad contradicts the triads: from L1 up to T12 they\
 run 180 degrees from it; check the cephalad direction and the vertebrae of the triads
    """
    if not triads:
        return
    positions = np.array([triad.position_mm for triad in triads.values()])
    require_chain_along(tuple(triads), positions @ patient_axes, "the triads", extra_levels, parameters)
    _require_behind(np.array([triad.rotation[:, 2] for triad in triads.values()]) @ patient_axes, parameters)


def require_chain_along(
    levels: Sequence[str],
    position_mm: Float,
    shown: str,
    extra_levels: Sequence[str] = (),
    parameters: PatientAxesParameters | None = None,
) -> None:
    """Refuse positions of vertebrae that do not run along the cephalad axis from the caudal to the cranial end.

    Parameters
    ----------
    levels
        Names of the n vertebrae in any order.
    position_mm
        Points of them in patient axes, shape (n, 3), mm.
    shown
        What the points are, for the message.
    extra_levels
        Vertebrae that this spine has in addition.
    parameters
        What axes must fulfil.

    Raises
    ------
    PatientAxesContradictedError
        If the angle between the line through the two ends and the cephalad axis is too large.
    LevelError
        If the name of a vertebra is unknown.

    Examples
    --------
    >>> import numpy as np
    >>> require_chain_along(("T12", "L1"), np.array([[0.0, 10, 30], [0, 0, 0]]), "the triads")
    """
    p = parameters or PatientAxesParameters()
    numbers = level_numbers(levels, extra_levels)
    top, bottom = int(np.argmin(numbers)), int(np.argmax(numbers))
    if top == bottom:
        return
    chord = np.asarray(position_mm)[top] - np.asarray(position_mm)[bottom]
    aside, up = float(np.linalg.norm(chord[:2])), float(chord[2])
    if aside - up * np.tan(np.radians(p.max_chain_angle_deg)) > p.chain_tolerance_mm:
        angle = np.degrees(np.arctan2(aside, up))
        raise PatientAxesContradictedError(
            f"cephalad contradicts {shown}: from {levels[bottom]} up to {levels[top]} they run {angle:.0f} degrees from"
            " it; check the cephalad direction and the vertebrae of the triads"
        )


def _require_behind(normals: Float, parameters: PatientAxesParameters | None) -> None:
    """Check that triads with normals (n, 3), patient axes, do not face the way of the anterior axis."""
    limit = (parameters or PatientAxesParameters()).min_front_angle_deg
    x, y, z = normals.mean(axis=0)
    angle = float(np.degrees(np.arctan2(np.hypot(y, z), x)))
    if angle < limit:
        raise PatientAxesContradictedError(
            f"left contradicts the triads: with it and cephalad, the anterior axis is {angle:.0f} degrees from the"
            " direction in which the triads face the cameras, but they stand behind the spine; check the left direction"
            " (left and right may be exchanged)"
        )


def _unit(direction: Float, name: str) -> Float:
    """Return a direction of unit length, or say what is wrong with it."""
    direction = np.asarray(direction, dtype=float)
    length = float(np.linalg.norm(direction))
    if direction.shape != (3,) or not np.isfinite(length) or length == 0:
        raise PatientAxesError(f"{name} is not a direction; give three finite numbers that are not all zero")
    return np.asarray(direction / length)
