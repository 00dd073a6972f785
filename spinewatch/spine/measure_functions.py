"""Formulas of the measures between given vertebrae (docs/measures.md); arrays of any leading shape."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.spine.orientation import tilts_of, twist_of


def wrapped(angle_deg: Float) -> Float:
    """Return angles between -180 (excluded) and 180 degrees.

    Parameters
    ----------
    angle_deg
        Angles, any shape, degrees.

    Returns
    -------
    Float
        The same angles less multiples of 360 degrees.

    Examples
    --------
    >>> wrapped(np.array([190.0, -180.0, 0.0]))
    array([-170.,  180.,    0.])
    """
    return np.asarray(180.0 - (180.0 - angle_deg) % 360.0)


def cobb_angle(upper: Float, lower: Float) -> Float:
    """Return the Cobb angle in the coronal plane, ``phi_lower - phi_upper``.

    Parameters
    ----------
    upper, lower
        Rotations of the upper and the lower end vertebra to patient axes, shape (..., 3, 3).

    Returns
    -------
    Float
        Shape (...), degrees; positive when the curve is convex to the right.
    """
    return wrapped(tilts_of(lower)[0] - tilts_of(upper)[0])


def kyphosis(cranial: Float, caudal: Float) -> Float:
    """Return the kyphosis between two vertebrae, ``theta_cranial - theta_caudal``.

    Parameters
    ----------
    cranial, caudal
        Rotations of the two to patient axes, shape (..., 3, 3).

    Returns
    -------
    Float
        Shape (...), degrees; negative is lordosis.
    """
    return wrapped(tilts_of(cranial)[1] - tilts_of(caudal)[1])


def lordosis(cranial: Float, caudal: Float) -> Float:
    """Return the lordosis between two vertebrae, the negative of their kyphosis.

    Parameters
    ----------
    cranial, caudal
        Rotations of the two to patient axes, shape (..., 3, 3).

    Returns
    -------
    Float
        Shape (...), degrees.
    """
    return wrapped(tilts_of(caudal)[1] - tilts_of(cranial)[1])


def projected_axial_rotation(rotation: Float) -> Float:
    """Return the axial rotation as the top view shows it, ``atan2(x.Y, x.X)``.

    Parameters
    ----------
    rotation
        Rotations from vertebra to patient axes, shape (..., 3, 3).

    Returns
    -------
    Float
        Shape (...), degrees; positive when the anterior side turns left.
    """
    return np.asarray(np.degrees(np.arctan2(rotation[..., 1, 0], rotation[..., 0, 0])))


def lateral_displacement(position_mm: Float, line_mm: Float | float = 0.0) -> Float:
    """Return the lateral displacement from the reference line, ``-(c - L).Y``.

    Parameters
    ----------
    position_mm
        Centroids, shape (..., 3), patient axes, mm.
    line_mm
        A point of the reference line, which is parallel to the patient's Z, shape (..., 3): the centroid of the
        reference vertebra; by default the origin of the spine's frame.

    Returns
    -------
    Float
        Shape (...), mm; positive to the right.
    """
    return np.asarray(-(position_mm - line_mm)[..., 1])


def coronal_balance(top_mm: Float, bottom_mm: Float) -> Float:
    """Return the coronal balance, ``-(c_top - c_bottom).Y``.

    Parameters
    ----------
    top_mm, bottom_mm
        Centroids of the most cranial and the most caudal vertebra, shape (..., 3), patient axes, mm.

    Returns
    -------
    Float
        Shape (...), mm; positive when the upper end is to the right.
    """
    return np.asarray(bottom_mm[..., 1] - top_mm[..., 1])


def angle_3d(upper: Float, lower: Float) -> Float:
    """Return the angle between the z axes of two vertebrae, ``acos(z_upper . z_lower)``.

    Parameters
    ----------
    upper, lower
        Rotations of the two end vertebrae to patient axes, shape (..., 3, 3).

    Returns
    -------
    Float
        Shape (...), degrees, between 0 and 180; by atan2, which keeps its digits near 0.
    """
    a, b = upper[..., 2], lower[..., 2]
    sine = np.linalg.norm(np.cross(a, b), axis=-1)
    return np.asarray(np.degrees(np.arctan2(sine, np.sum(a * b, axis=-1))))


def horizontal_difference(upper: Float, lower: Float) -> Float:
    """Return the horizontal part of ``z_upper - z_lower``, whose direction is the plane of maximum curvature.

    Parameters
    ----------
    upper, lower
        Rotations of the two end vertebrae to patient axes, shape (..., 3, 3).

    Returns
    -------
    Float
        Shape (..., 2): anterior and left; 0.02 are some degree.
    """
    return np.asarray(upper[..., :2, 2] - lower[..., :2, 2])


def plane_of_maximum_curvature(upper: Float, lower: Float) -> Float:
    """Return the azimuth of the plane of maximum curvature, that of the horizontal part of ``z_upper - z_lower``.

    Parameters
    ----------
    upper, lower
        Rotations of the two end vertebrae to patient axes, shape (..., 3, 3).

    Returns
    -------
    Float
        Shape (...), degrees: 0 for a kyphosis, 90 for a curve convex to the right, -90 to the left, 180 for a lordosis.
    """
    d = horizontal_difference(upper, lower)
    return np.asarray(np.degrees(np.arctan2(d[..., 1], d[..., 0])))


def ferguson_angle(upper_mm: Float, apex_mm: Float, lower_mm: Float) -> Float:
    """Return the Ferguson angle, between the lines from the apex to the end vertebrae in the coronal plane.

    Parameters
    ----------
    upper_mm, apex_mm, lower_mm
        Centroids, shape (..., 3), patient axes, mm.

    Returns
    -------
    Float
        Shape (...), degrees; positive when the curve is convex to the right.

    Examples
    --------
    >>> upper, apex, lower = np.array([[0.0, 0, 100], [0, -100, 0], [0, 0, -100]])
    >>> float(ferguson_angle(upper, apex, lower))
    90.0
    """
    return wrapped(_line_tilt(apex_mm - lower_mm) - _line_tilt(upper_mm - apex_mm))


def _line_tilt(line: Float) -> Float:
    """Return the coronal tilt of lines (..., 3), degrees."""
    return np.asarray(np.degrees(np.arctan2(-line[..., 1], line[..., 2])))


@dataclass(frozen=True)
class Formula:
    """A measure as a function of the poses of the vertebrae that it is measured between, cranial first.

    Attributes
    ----------
    function
        From centroids (..., k, 3) and rotations (..., k, 3, 3) in patient axes to values (...).
    positions, rotations
        Whether it depends on the centroids and on the rotations.
    from_line
        Whether it is measured from the reference line; the reference vertebra is then the last one, if it is known.
    """

    function: Callable[[Float, Float], Float]
    positions: bool = False
    rotations: bool = False
    from_line: bool = False


def _from_line(c: Float, R: Float) -> Float:
    """Return the lateral displacement of the first of one or two vertebrae."""
    return lateral_displacement(c[..., 0, :], c[..., 1, :] if c.shape[-2] > 1 else 0.0)


FORMULAS: Mapping[str, Formula] = {
    "cobb-fixed": Formula(lambda c, R: cobb_angle(R[..., 0, :, :], R[..., 1, :, :]), rotations=True),
    "cobb-reselected": Formula(lambda c, R: cobb_angle(R[..., 0, :, :], R[..., 1, :, :]), rotations=True),
    "kyphosis": Formula(lambda c, R: kyphosis(R[..., 0, :, :], R[..., 1, :, :]), rotations=True),
    "lordosis": Formula(lambda c, R: lordosis(R[..., 0, :, :], R[..., 1, :, :]), rotations=True),
    "apical-rotation": Formula(lambda c, R: twist_of(R[..., 0, :, :]), rotations=True),
    "apical-rotation-projected": Formula(
        lambda c, R: projected_axial_rotation(R[..., 0, :, :]), rotations=True
    ),
    "apical-translation": Formula(_from_line, positions=True, from_line=True),
    "coronal-balance": Formula(lambda c, R: coronal_balance(c[..., 0, :], c[..., 1, :]), positions=True),
    "angle-3d": Formula(lambda c, R: angle_3d(R[..., 0, :, :], R[..., 1, :, :]), rotations=True),
    "plane-of-maximum-curvature": Formula(
        lambda c, R: plane_of_maximum_curvature(R[..., 0, :, :], R[..., 1, :, :]), rotations=True
    ),
    "ferguson": Formula(
        lambda c, R: ferguson_angle(c[..., 0, :], c[..., 1, :], c[..., 2, :]), positions=True
    ),
    "coronal-tilt": Formula(lambda c, R: tilts_of(R[..., 0, :, :])[0], rotations=True),
    "sagittal-tilt": Formula(lambda c, R: tilts_of(R[..., 0, :, :])[1], rotations=True),
    "axial-rotation": Formula(lambda c, R: twist_of(R[..., 0, :, :]), rotations=True),
    "lateral-displacement": Formula(_from_line, positions=True, from_line=True),
}
"""Formula of each measure between given vertebrae, by the identifier of its definition."""
