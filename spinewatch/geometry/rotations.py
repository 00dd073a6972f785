"""Rotations: Rodrigues' formula, rotation vectors, their Jacobians, and photogrammetric angles.

Angles are in radians, except those of `rotation_from_angles` and `angles_from_rotation`.
"""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float

_SMALL_ANGLE_RAD = 1e-4


def cross_matrix(v: Float) -> Float:
    """Return the skew-symmetric matrices of vectors.

    Parameters
    ----------
    v
        Vectors, shape (..., 3).

    Returns
    -------
    Float
        Matrices [v]x, shape (..., 3, 3), with ``cross_matrix(v) @ w == np.cross(v, w)``.

    Examples
    --------
    >>> import numpy as np
    >>> cross_matrix(np.array([0.0, 0.0, 1.0])) @ np.array([1.0, 0.0, 0.0])
    array([0., 1., 0.])
    """
    half = np.zeros((*v.shape, 3))
    half[..., 2, 1], half[..., 0, 2], half[..., 1, 0] = v[..., 0], v[..., 1], v[..., 2]
    return half - np.swapaxes(half, -1, -2)


def rotation_from_vector(vector_rad: Float) -> Float:
    """Return the rotations of rotation vectors, by Rodrigues' formula.

    Parameters
    ----------
    vector_rad
        Rotation vectors, axis times angle, shape (..., 3), radians.

    Returns
    -------
    Float
        Rotation matrices Exp([v]x), shape (..., 3, 3).

    Examples
    --------
    >>> import numpy as np
    >>> rotation_from_vector(np.array([0.0, 0.0, np.pi / 2])).round(12) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    half_angle = 0.5 * np.linalg.norm(vector_rad, axis=-1)[..., None, None]
    W = cross_matrix(vector_rad)
    sinc = np.sinc(half_angle / np.pi)
    return np.asarray(np.eye(3) + sinc * np.cos(half_angle) * W + 0.5 * sinc**2 * (W @ W))


def vector_from_rotation(R: Float) -> Float:
    """Return the rotation vectors of rotations.

    By way of the quaternion of largest component, which keeps its digits near 0 and near 180 degrees.

    Parameters
    ----------
    R
        Rotation matrices, shape (..., 3, 3).

    Returns
    -------
    Float
        Rotation vectors, shape (..., 3), radians, of length at most pi.

    References
    ----------
    S. W. Shepperd, "Quaternion from rotation matrix", J. Guidance and Control 1 (1978) 223-224.

    Examples
    --------
    >>> import numpy as np
    >>> vector_from_rotation(np.diag([1.0, -1.0, -1.0]))
    array([3.14159265, 0.        , 0.        ])
    """
    vectors = [_vector_from_rotation(matrix) for matrix in np.reshape(R, (-1, 3, 3))]
    return np.array(vectors).reshape(R.shape[:-1])


def _vector_from_rotation(R: Float) -> Float:
    t = np.trace(R)
    q2 = np.array([t, R[0, 0], R[1, 1], R[2, 2]])
    i = int(np.argmax(q2))
    if i == 0:
        q = np.array([1 + t, R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    else:
        j, k = i % 3 + 1, (i + 1) % 3 + 1
        q = np.empty(4)
        q[0] = R[k - 1, j - 1] - R[j - 1, k - 1]
        q[i] = 1 + 2 * R[i - 1, i - 1] - t
        q[j] = R[j - 1, i - 1] + R[i - 1, j - 1]
        q[k] = R[k - 1, i - 1] + R[i - 1, k - 1]
    q = q / np.linalg.norm(q) * (-1 if q[0] < 0 else 1)
    sine = np.linalg.norm(q[1:])
    if sine == 0:
        return np.zeros(3)
    return np.asarray(q[1:] / sine * 2 * np.arctan2(sine, q[0]))


def left_jacobian(vector_rad: Float) -> Float:
    """Return the left Jacobian of the rotation of a vector.

    Parameters
    ----------
    vector_rad
        Rotation vector v, shape (3,), radians.

    Returns
    -------
    Float
        J, shape (3, 3), with Exp(v + d) = Exp(J d) Exp(v) to first order in d.
    """
    angle = float(np.linalg.norm(vector_rad))
    W = cross_matrix(vector_rad)
    if angle < _SMALL_ANGLE_RAD:
        return np.eye(3) + 0.5 * W + W @ W / 6
    return np.asarray(
        np.eye(3) + (1 - np.cos(angle)) / angle**2 * W + (1 - np.sin(angle) / angle) / angle**2 * (W @ W)
    )


def inverse_left_jacobian(vector_rad: Float) -> Float:
    """Return the inverse of the left Jacobian of the rotation of a vector.

    Parameters
    ----------
    vector_rad
        Rotation vector v, shape (3,), radians.

    Returns
    -------
    Float
        J, shape (3, 3), with Log(Exp(d) Exp(v)) = v + J d to first order in d.
    """
    angle = float(np.linalg.norm(vector_rad))
    W = cross_matrix(vector_rad)
    if angle < _SMALL_ANGLE_RAD:
        return np.eye(3) - 0.5 * W + W @ W / 12
    half = angle / 2
    return np.asarray(np.eye(3) - 0.5 * W + (1 - half / np.tan(half)) / angle**2 * (W @ W))


def rotation_from_angles(omega_deg: float, phi_deg: float, kappa_deg: float) -> Float:
    """Return the rotation of the photogrammetric angles.

    Parameters
    ----------
    omega_deg, phi_deg, kappa_deg
        Successive angles about x, y and z, degrees.

    Returns
    -------
    Float
        ``M = M_kappa M_phi M_omega``, shape (3, 3), from object axes to camera axes.

    References
    ----------
    Thesis eq. 5.4.
    """
    (so, sp, sk), (co, cp, ck) = (f(np.radians([omega_deg, phi_deg, kappa_deg])) for f in (np.sin, np.cos))
    return np.array(
        [
            [cp * ck, co * sk + so * sp * ck, so * sk - co * sp * ck],
            [-cp * sk, co * ck - so * sp * sk, so * ck + co * sp * sk],
            [sp, -so * cp, co * cp],
        ]
    )


def angles_from_rotation(M: Float) -> tuple[float, float, float]:
    """Return the photogrammetric angles of a rotation, the inverse of `rotation_from_angles`.

    Parameters
    ----------
    M
        Rotation from object axes to camera axes, shape (3, 3).

    Returns
    -------
    tuple of float
        omega, phi, kappa in degrees; phi is between -90 and 90.

    References
    ----------
    Thesis eq. 5.4.

    Examples
    --------
    >>> [round(angle, 9) for angle in angles_from_rotation(rotation_from_angles(10.0, -20.0, 30.0))]
    [10.0, -20.0, 30.0]
    """
    omega, kappa = np.arctan2(-M[2, 1], M[2, 2]), np.arctan2(-M[1, 0], M[0, 0])
    phi = np.arctan2(M[2, 0], np.hypot(M[2, 1], M[2, 2]))
    return float(np.degrees(omega)), float(np.degrees(phi)), float(np.degrees(kappa))


def variance_about(axis: Float, covariance: Float) -> float:
    """Return the variance of a small rotation about an axis: to first order that of the angle of a rotation about it.

    Parameters
    ----------
    axis
        The axis, of any length, shape (3,): a rotation vector; zero where there is none.
    covariance
        Covariance of the small rotation, shape (3, 3), any unit.

    Returns
    -------
    float
        The variance, in the unit of the covariance; without an axis that about the axis of the largest one.

    Examples
    --------
    >>> import numpy as np
    >>> variances = np.diag([1.0, 4.0, 9.0])
    >>> variance_about(np.array([0.0, 0.5, 0.0]), variances), variance_about(np.zeros(3), variances)
    (4.0, 9.0)
    """
    length = np.linalg.norm(axis)
    if length > 0:
        unit = axis / length
        return float(np.clip(unit @ covariance @ unit, 0, None))
    return float(np.clip(np.linalg.eigvalsh(covariance)[-1], 0, None))


def nearest_rotation(A: Float) -> Float:
    """Return the rotation nearest to a matrix in the Frobenius norm.

    Parameters
    ----------
    A
        Matrix, shape (3, 3).

    Returns
    -------
    Float
        Rotation, shape (3, 3), of determinant +1.
    """
    U, _, Vt = np.linalg.svd(A)
    return np.asarray(U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt)
