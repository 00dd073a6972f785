"""Orientation of a vertebra in patient axes: coronal tilt, sagittal tilt, axial rotation, and their gradients."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import cross_matrix


def axis_from_tilts(coronal_rad: Float, sagittal_rad: Float) -> Float:
    """Return the z axis of a vertebra with given tilts, along (tan sagittal, -tan coronal, 1).

    Parameters
    ----------
    coronal_rad, sagittal_rad
        Tilts atan2(-z.Y, z.Z) and atan2(z.X, z.Z), shape (...), between -pi / 2 and pi / 2 radians.

    Returns
    -------
    Float
        Unit vectors in patient axes, shape (..., 3).

    Examples
    --------
    >>> axis_from_tilts(np.array(0.0), np.radians(30.0)).round(3) + 0.0
    array([0.5  , 0.   , 0.866])
    """
    z = np.stack([np.tan(sagittal_rad), -np.tan(coronal_rad), np.ones_like(coronal_rad)], axis=-1)
    return np.asarray(z / np.linalg.norm(z, axis=-1, keepdims=True))


def rotation_from_tilts(
    coronal_deg: Float | float, sagittal_deg: Float | float, axial_deg: Float | float
) -> Float:
    """Return the rotation of a vertebra with given tilts and axial rotation.

    Parameters
    ----------
    coronal_deg
        Coronal tilt, any shape, between -90 and 90 degrees; positive has the left side up.
    sagittal_deg
        Sagittal tilt, same shape, between -90 and 90 degrees; positive leans forwards.
    axial_deg
        Axial rotation (twist about the vertebra's own z), same shape, degrees; positive turns the anterior side to the
        left.

    Returns
    -------
    Float
        Rotations from vertebra to patient axes, shape (..., 3, 3).

    References
    ----------
    Swing-twist decomposition: ``R = swing(Z to z) Exp(axial Z)`` with z along (tan sagittal, -tan coronal, 1). Axes as
    of Stokes, "Three-dimensional terminology of spinal deformity", Spine 19 (1994) 236.

    Examples
    --------
    >>> rotation_from_tilts(0.0, 0.0, 90.0).round(9) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    coronal, sagittal, axial = (
        np.radians(np.asarray(angle, dtype=float)) for angle in (coronal_deg, sagittal_deg, axial_deg)
    )
    coronal, sagittal, axial = np.broadcast_arrays(coronal, sagittal, axial)
    z = axis_from_tilts(coronal, sagittal)
    o = np.zeros_like(axial)
    K = cross_matrix(np.stack([-z[..., 1], z[..., 0], o], axis=-1))
    swing = np.eye(3) + K + K @ K / (1 + z[..., 2])[..., None, None]
    c, s = np.cos(axial), np.sin(axial)
    twist = np.stack([np.stack([c, -s, o], -1), np.stack([s, c, o], -1), np.stack([o, o, o + 1], -1)], -2)
    return np.asarray(swing @ twist)


def tilts_of(rotation: Float) -> tuple[Float, Float, Float]:
    """Return the tilts and the axial rotation of vertebrae, the inverse of `rotation_from_tilts`.

    Parameters
    ----------
    rotation
        Rotations from vertebra to patient axes, shape (..., 3, 3).

    Returns
    -------
    coronal_deg
        ``atan2(-z.Y, z.Z)``, shape (...), degrees.
    sagittal_deg
        ``atan2(z.X, z.Z)``, shape (...), degrees.
    axial_deg
        Twist about z, `twist_of`, shape (...), degrees.

    Examples
    --------
    >>> [round(float(angle), 9) for angle in tilts_of(rotation_from_tilts(10.0, -20.0, 30.0))]
    [10.0, -20.0, 30.0]
    """
    x, y, z = np.moveaxis(rotation[..., 2], -1, 0)
    return (
        np.asarray(np.degrees(np.arctan2(-y, z))),
        np.asarray(np.degrees(np.arctan2(x, z))),
        twist_of(rotation),
    )


def twist_of(rotation: Float) -> Float:
    """Return the twist about z of rotations, from their swing-twist decomposition.

    Parameters
    ----------
    rotation
        Rotations, shape (..., 3, 3).

    Returns
    -------
    Float
        Angles ``2 atan2(q_z, q_w)`` of the quaternions, shape (...), between -180 and 180 degrees.

    References
    ----------
    With the elements of the matrix: ``tan(twist) = (R_10 - R_01) / (R_00 + R_11)``.
    """
    R = rotation
    return np.asarray(np.degrees(np.arctan2(R[..., 1, 0] - R[..., 0, 1], R[..., 0, 0] + R[..., 1, 1])))


def twist_gradient(rotation: Float) -> Float:
    """Return the gradient of the twist about z.

    Parameters
    ----------
    rotation
        Rotations, shape (..., 3, 3).

    Returns
    -------
    Float
        Change of the twist with a small rotation about each of the frame's axes, ``R_true = Exp(dtheta) R``, shape
        (..., 3), degrees per degree.
    """
    z = rotation[..., 2]
    return np.asarray(np.stack([z[..., 0], z[..., 1], 1 + z[..., 2]], axis=-1) / (1 + z[..., 2])[..., None])


def tilt_gradients(rotation: Float) -> Float:
    """Return the gradients of the tilts and of the axial rotation.

    Parameters
    ----------
    rotation
        Rotations from vertebra to patient axes, shape (..., 3, 3).

    Returns
    -------
    Float
        Shape (..., 3, 3): rows coronal tilt, sagittal tilt, axial rotation; columns a small rotation about the
        patient's x, y and z, ``R_true = Exp(dtheta) R``; degrees per degree.
    """
    x, y, z = np.moveaxis(rotation[..., 2], -1, 0)
    one = np.ones_like(x)
    yz, xz = y**2 + z**2, x**2 + z**2
    coronal = np.stack([one, -x * y / yz, -x * z / yz], axis=-1)
    sagittal = np.stack([-x * y / xz, one, -y * z / xz], axis=-1)
    return np.stack([coronal, sagittal, twist_gradient(rotation)], axis=-2)
