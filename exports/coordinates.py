"""Coordinate systems of other software: LPS, RAS and glTF, from the spine's own patient axes."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float

LPS_FROM_PATIENT = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""From patient axes (x anterior, y left, z cephalad) to left, posterior, superior: DICOM, ITK, files of 3D Slicer."""

RAS_FROM_PATIENT = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""From patient axes to right, anterior, superior: 3D Slicer's scene, and with it OpenIGTLink."""

GLTF_FROM_PATIENT = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
"""From patient axes to glTF's: y up (cephalad), z where the asset faces (anterior), hence x to its left."""


def point(axes: Float, position_mm: Float) -> Float:
    """Return a point in other axes.

    Parameters
    ----------
    axes
        One of the rotations of this module, shape (3, 3).
    position_mm
        The point in patient axes, shape (3,), mm.

    Returns
    -------
    Float
        The point, shape (3,), mm.

    Examples
    --------
    >>> point(LPS_FROM_PATIENT, np.array([1.0, 2.0, 3.0])).tolist()
    [2.0, -1.0, 3.0]
    """
    return np.asarray(axes @ position_mm)


def transform(axes: Float, rotation: Float, translation_mm: Float) -> Float:
    """Return a rigid transform in other axes.

    Both sides of the transform change their axes: a body whose own axes are parallel to the patient's has the identity
    as its rotation in every coordinate system.

    Parameters
    ----------
    axes
        One of the rotations of this module, shape (3, 3).
    rotation
        Rotation in patient axes, shape (3, 3).
    translation_mm
        Translation in patient axes, shape (3,), mm.

    Returns
    -------
    Float
        Homogeneous matrix, shape (4, 4), mm.

    Examples
    --------
    >>> quarter_turn_about_x = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    >>> transform(RAS_FROM_PATIENT, quarter_turn_about_x, np.array([1.0, 2.0, 3.0])).astype(int).tolist()
    [[0, 0, 1, -2], [0, 1, 0, 1], [-1, 0, 0, 3], [0, 0, 0, 1]]
    """
    matrix = np.eye(4)
    matrix[:3, :3] = axes @ rotation @ axes.T
    matrix[:3, 3] = axes @ translation_mm
    return matrix


def inverse(matrix: Float) -> Float:
    """Return the inverse of a rigid transform.

    Parameters
    ----------
    matrix
        Homogeneous matrix of a rotation and a translation, shape (4, 4).

    Returns
    -------
    Float
        Its inverse, shape (4, 4).
    """
    inverted = np.eye(4)
    inverted[:3, :3] = matrix[:3, :3].T
    inverted[:3, 3] = -matrix[:3, :3].T @ matrix[:3, 3]
    return inverted
