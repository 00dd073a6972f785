"""Interpolation as weights of the knots: cubic splines and straight lines; NumPy only."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float


def natural_spline_weights(knots: Float, at: Float) -> Float:
    """Return the weights of a natural cubic spline: C2, without curvature at both ends.

    Parameters
    ----------
    knots
        Parameters of the m knots, shape (m,), increasing, at least two.
    at
        Parameters of the interpolated values, shape (q,).

    Returns
    -------
    Float
        W, shape (q, m): the spline through values f has the values W f. Two knots give a straight line.

    References
    ----------
    C. de Boor, A Practical Guide to Splines, ch. IV: a tridiagonal system of the second derivatives.

    Examples
    --------
    >>> import numpy as np
    >>> (natural_spline_weights(np.array([0.0, 1, 2]), np.array([0.5])) @ np.array([0.0, 1, 0])).round(6)
    array([0.6875])
    """
    A, B = _second_derivative_system(knots)
    return _cubic_weights(knots, at, np.asarray(np.linalg.solve(A, B)))


def secant_spline_weights(knots: Float, at: Float) -> Float:
    """Return the weights of a cubic spline whose slopes at both ends are those of its first and last chord.

    Parameters
    ----------
    knots
        Parameters of the m knots, shape (m,), increasing, at least two.
    at
        Parameters of the interpolated values, shape (q,).

    Returns
    -------
    Float
        W, shape (q, m).

    References
    ----------
    The small-angle limit of `scipy.spatial.transform.RotationSpline`, whose angular rates at both ends are those of the
    first and last rotation.
    """
    A, B = _second_derivative_system(knots)
    # The slope at an end differs from that of its chord by h (2 M_end + M_next) / 6.
    A[0, :2] = 2, 1
    A[-1, -2:] = 1, 2
    return _cubic_weights(knots, at, np.asarray(np.linalg.solve(A, B)))


def linear_weights(knots: Float, at: Float) -> Float:
    """Return the weights of straight lines between knots.

    Parameters
    ----------
    knots
        Parameters of the m knots, shape (m,), increasing, at least two.
    at
        Parameters of the interpolated values, shape (q,).

    Returns
    -------
    Float
        W, shape (q, m).

    Examples
    --------
    >>> import numpy as np
    >>> linear_weights(np.array([0.0, 2.0]), np.array([0.5]))
    array([[0.75, 0.25]])
    """
    return _cubic_weights(knots, at, np.zeros((len(knots), len(knots))))


def _second_derivative_system(knots: Float) -> tuple[Float, Float]:
    """Return A, B (m, m) with ``A M = B f`` for the second derivatives M of a C2 spline that vanish at both ends."""
    m = len(knots)
    h = np.diff(knots)
    A, B = np.eye(m), np.zeros((m, m))
    for i in range(1, m - 1):
        A[i, i - 1 : i + 2] = h[i - 1] / 6, (h[i - 1] + h[i]) / 3, h[i] / 6
        B[i, i - 1 : i + 2] = 1 / h[i - 1], -1 / h[i - 1] - 1 / h[i], 1 / h[i]
    return A, B


def _cubic_weights(knots: Float, at: Float, second: Float) -> Float:
    """Return weights (q, m) of the cubics whose second derivatives at the knots are ``second @ f``."""
    i = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, len(knots) - 2)
    h = knots[i + 1] - knots[i]
    b = (at - knots[i]) / h
    a = 1 - b
    eye = np.eye(len(knots))
    curved = (a**3 - a)[:, None] * second[i] + (b**3 - b)[:, None] * second[i + 1]
    return np.asarray(a[:, None] * eye[i] + b[:, None] * eye[i + 1] + (h**2 / 6)[:, None] * curved)
