"""Errors of the patient axes, which all poses of a spine have in common; NumPy only."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float
from spinewatch.geometry.covariance import covariance_factor
from spinewatch.geometry.rotations import cross_matrix
from spinewatch.spine.patient_axes import axes_from_directions, axes_from_landmarks


def direction_axes_covariance(
    cephalad: Float, left: Float, cephalad_sd_deg: float, left_sd_deg: float
) -> Float:
    """Return the covariance of the patient axes of two directions.

    Parameters
    ----------
    cephalad, left
        Directions to the head and to the patient's left in object space, shape (3,), of any length.
    cephalad_sd_deg, left_sd_deg
        Standard deviations of the two about each axis perpendicular to them, degrees; their errors are independent.

    Returns
    -------
    Float
        Covariance of a small rotation of the axes about themselves, shape (3, 3), degrees^2: the true axes are ``P
        Exp(e)``, with P those of `axes_from_directions`.

    Raises
    ------
    PatientAxesError
        If the directions determine no axes.

    References
    ----------
    To first order: cephalad is kept, so that its errors are the rotations about x and y. Left ``cos(b) y + sin(b) z``
    with an error d towards x turns the axes about z by ``e_y tan(b) - d / cos(b)``.

    Examples
    --------
    >>> import numpy as np
    >>> direction_axes_covariance(np.array([1.0, 0, 0]), np.array([0, 1.0, 0]), 2.0, 3.0).round(9) + 0.0
    array([[4., 0., 0.],
           [0., 4., 0.],
           [0., 0., 9.]])
    """
    axes = axes_from_directions(cephalad, left)
    _, across, along = axes.T @ left / np.linalg.norm(left)
    J = np.zeros((3, 3))
    J[0, 0] = J[1, 1] = cephalad_sd_deg
    J[2, 1:] = cephalad_sd_deg * along / across, -left_sd_deg / across
    return np.asarray(J @ J.T)


def landmark_axes_covariance(
    caudal_mm: Float, cephalad_mm: Float, left_mm: Float, landmark_sd_mm: float
) -> Float:
    """Return the covariance of the patient axes of three landmarks.

    Parameters
    ----------
    caudal_mm, cephalad_mm, left_mm
        The landmarks, shape (3,), object space, mm.
    landmark_sd_mm
        Standard deviation of each of them per axis, mm; their errors are independent.

    Returns
    -------
    Float
        As `direction_axes_covariance`, shape (3, 3), degrees^2.

    Raises
    ------
    PatientAxesError
        If the landmarks determine no axes.

    References
    ----------
    The direction to the head is the difference of two landmarks, that to the left starts at their mean. Errors of
    difference and mean of two landmarks are independent.

    Examples
    --------
    >>> import numpy as np
    >>> points = np.array([[0.0, 0, 0], [0, 0, 400], [0, 100, 200]])
    >>> np.sqrt(np.diag(landmark_axes_covariance(*points, 7.0))).round(2)
    array([1.42, 1.42, 4.91])
    """
    axes_from_landmarks(caudal_mm, cephalad_mm, left_mm)
    up = np.asarray(cephalad_mm, dtype=float) - caudal_mm
    aside = np.asarray(left_mm, dtype=float) - (np.asarray(caudal_mm) + cephalad_mm) / 2
    up_sd, aside_sd = (
        float(np.degrees(landmark_sd_mm * np.sqrt(n) / np.linalg.norm(v)))
        for n, v in ((2.0, up), (1.5, aside))
    )
    return direction_axes_covariance(up, aside, up_sd, aside_sd)


def turning(position_mm: Float) -> Float:
    """Return how poses change when all of them are turned about the origin.

    Parameters
    ----------
    position_mm
        Positions, shape (n, 3), mm; NaN where there is no pose.

    Returns
    -------
    Float
        Jacobian by a small rotation about each axis, shape (n, 6, 3), mm and degrees per degree; rows as of
        `Pose.covariance`. Zero where there is no pose.

    Examples
    --------
    >>> import numpy as np
    >>> turning(np.array([[0.0, 0.0, 100.0]]))[0, :3].round(3) + 0.0
    array([[ 0.   ,  1.745,  0.   ],
           [-1.745,  0.   ,  0.   ],
           [ 0.   ,  0.   ,  0.   ]])
    """
    placed = np.isfinite(position_mm).all(axis=1)
    J = np.zeros((len(position_mm), 6, 3))
    J[placed, :3] = -cross_matrix(position_mm[placed]) * np.radians(1.0)
    J[placed, 3:] = np.eye(3)
    return J


def axes_factor(covariance_deg2: Float) -> Float:
    """Return the independent errors of patient axes.

    Parameters
    ----------
    covariance_deg2
        Their covariance as of `direction_axes_covariance`, shape (3, 3), degrees^2.

    Returns
    -------
    Float
        Shape (3, 3), degrees: a column per unit error; no column, shape (3, 0), for axes without an error.
    """
    if not np.asarray(covariance_deg2).any():
        return np.zeros((3, 0))
    return covariance_factor(covariance_deg2)
