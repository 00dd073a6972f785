"""Propagation of the errors of a spine to a measure: common error factors, gradients, 95% intervals."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.spine.configuration import SpineConfiguration

QUANTILE_95 = 1.959963984540054
"""Half the width of a 95% interval in standard deviations, for a normal distribution."""

_STEP = 1e-3
"""Step of the central differences, mm and degrees: relative errors below 1e-9."""

_SHIFTS = np.concatenate([np.eye(6), -np.eye(6)]) * _STEP
_TURNS = rotation_from_vector(np.radians(_SHIFTS[:, 3:]))


def common_factors(configurations: Sequence[SpineConfiguration]) -> tuple[Float, ...]:
    """Return the errors of several configurations with common columns.

    Parameters
    ----------
    configurations
        The configurations; sources of the same name are the same errors.

    Returns
    -------
    tuple of Float
        For each configuration its error factors side by side, shape (n, 6, r): one column per independent unit error of
        any of them, zero where a configuration does not have it.
    """
    widths = {
        source: factor.shape[2]
        for configuration in configurations
        for source, factor in configuration.errors.items()
    }
    return tuple(
        np.concatenate(
            [
                configuration.errors.get(source, np.zeros((len(configuration.levels), 6, width)))
                for source, width in widths.items()
            ]
            or [np.zeros((len(configuration.levels), 6, 1))],
            axis=2,
        )
        for configuration in configurations
    )


def gradient(function: Callable[[Float, Float], Float], position_mm: Float, rotation: Float) -> Float:
    """Return the gradient of a function of poses by central differences.

    Parameters
    ----------
    function
        From centroids (..., k, 3) and rotations (..., k, 3, 3) to values (...) or (..., m), evaluated once.
    position_mm, rotation
        The poses, shapes (k, 3) and (k, 3, 3).

    Returns
    -------
    Float
        Shape (k, 6) or (k, 6, m): change with the position (mm) and with a small rotation about each axis of the frame
        (degrees), ``R_true = Exp(dtheta) R``.

    Examples
    --------
    >>> at = np.array([[1.0, 2.0, 3.0]])
    >>> gradient(lambda c, R: c[..., 0, 1] ** 2, at, np.eye(3)[None]).round(6)
    array([[0., 4., 0., 0., 0., 0.]])
    """
    k = len(position_mm)
    roles = np.arange(k)
    positions, rotations = np.empty((12, k, k, 3)), np.empty((12, k, k, 3, 3))
    positions[:], rotations[:] = position_mm, rotation
    positions[:, roles, roles] += _SHIFTS[:, None, :3]
    rotations[:, roles, roles] = _TURNS[:, None] @ rotation
    values = function(positions, rotations)
    return np.asarray(np.swapaxes((values[:6] - values[6:]) / (2 * _STEP), 0, 1))


def angle_gradient(function: Callable[[Float, Float], Float], position_mm: Float, rotation: Float) -> Float:
    """Return the gradient of an angle, which may jump by 360 degrees.

    Parameters
    ----------
    function
        From centroids (..., k, 3) and rotations (..., k, 3, 3) to angles (...), degrees.
    position_mm, rotation
        The poses, shapes (k, 3) and (k, 3, 3).

    Returns
    -------
    Float
        As `gradient`, shape (k, 6).
    """
    at = function(position_mm, rotation)
    return gradient(lambda c, R: (function(c, R) - at + 180.0) % 360.0, position_mm, rotation)


def errors_of(gradients: Float, factor: Float) -> Float:
    """Return the errors of a value by independent source.

    Parameters
    ----------
    gradients
        Gradient by the poses of k vertebrae, shape (k, 6) or (k, 6, m).
    factor
        Error factors of these vertebrae, shape (k, 6, r).

    Returns
    -------
    Float
        Error of the value per unit error of each source, shape (r,) or (m, r).
    """
    flat = gradients.reshape(-1, *gradients.shape[2:])
    return np.asarray(flat.T @ factor.reshape(flat.shape[0], -1))


def normal_interval(value: Float | float, sd: float) -> tuple[float, float]:
    """Return the 95% interval of a value with normal errors, widened to alternatives of the value.

    Parameters
    ----------
    value
        The value, or the value and its alternatives.
    sd
        Its standard deviation.

    Returns
    -------
    tuple of float
        Lower and upper end.

    Examples
    --------
    >>> [round(end, 2) for end in normal_interval(np.array([10.0, 12.0]), 1.0)]
    [8.04, 13.96]
    """
    return float(np.min(value)) - QUANTILE_95 * sd, float(np.max(value)) + QUANTILE_95 * sd
