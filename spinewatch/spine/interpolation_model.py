"""What interpolation between marked vertebrae cannot know: the covariance of its error; NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.geometry.covariance import covariance_factor


@dataclass(frozen=True)
class InterpolationParameters:
    """How far vertebrae without a marker may be from where interpolation places them.

    The true values along the spine are taken as a smooth random function, and an independent deviation of each vertebra
    from it.

    Attributes
    ----------
    correlation_levels
        Distance over which the smooth part is alike: its correlation falls to exp(-1/2), levels. A wave of 17 levels,
        which is a curve of some eight levels from end to end, has 17 / (2 pi) = 2.7.
    amplitude_share
        Standard deviation of the smooth part as a share of the range that marked vertebrae show; a wave that they show
        whole has 0.35, and they seldom do.
    cross_axis
        Least amplitude of a rotation about one axis, as a share of the greatest about any: rotations about different
        axes mix.
    rotation_amplitude_deg
        Least amplitude of a rotation about an axis, degrees. Otherwise it follows from the range of the rotation
        vectors of marked vertebrae.
    rotation_irregularity_deg
        Standard deviation of the deviation of each vertebra, per axis, degrees.
    position_amplitude_mm
        Least amplitude of a coordinate, mm. Otherwise it follows from the range of the marked vertebrae about the
        straight line between the first and the last one.
    position_irregularity_mm
        Standard deviation of the deviation of each vertebra, per axis, mm.
    """

    correlation_levels: float = 2.7
    amplitude_share: float = 0.6
    cross_axis: float = 0.5
    rotation_amplitude_deg: float = 2.0
    rotation_irregularity_deg: float = 0.5
    position_amplitude_mm: float = 3.0
    position_irregularity_mm: float = 0.3


def rotation_amplitude(angles_deg: Float, parameters: InterpolationParameters) -> Float:
    """Return the amplitude of the smooth part of rotations, from those of marked vertebrae.

    Parameters
    ----------
    angles_deg
        Rotation vectors of the m marked vertebrae from one of them, shape (m, 3), degrees.
    parameters
        The least amplitudes.

    Returns
    -------
    Float
        Per axis, shape (3,), degrees.
    """
    seen = parameters.amplitude_share * np.ptp(angles_deg, axis=0)
    return np.asarray(
        np.maximum(np.maximum(seen, parameters.cross_axis * seen.max()), parameters.rotation_amplitude_deg)
    )


def position_amplitude(values_mm: Float, places: Float, parameters: InterpolationParameters) -> Float:
    """Return the amplitude of the smooth part of coordinates, from those of marked vertebrae.

    Parameters
    ----------
    values_mm
        Positions or displacements of the m marked vertebrae, shape (m, 3), mm.
    places
        Their places along the spine, shape (m,), increasing.
    parameters
        The least amplitudes.

    Returns
    -------
    Float
        Per axis, shape (3,), mm.
    """
    share = (places - places[0]) / (places[-1] - places[0])
    line = values_mm[0] + share[:, None] * (values_mm[-1] - values_mm[0])
    seen = parameters.amplitude_share * np.ptp(values_mm - line, axis=0)
    return np.asarray(np.maximum(seen, parameters.position_amplitude_mm))


def interpolation_error(
    places: Float,
    knots: Int,
    at: Int,
    weights: Float,
    *,
    amplitude: Float,
    irregularity: float,
    correlation_levels: float,
) -> Float:
    """Return a factor of the errors of interpolated values that the values at the knots leave open.

    Parameters
    ----------
    places
        Places of the vertebrae along the spine, shape (n,), levels.
    knots, at
        Indices of the m knots and of the q interpolated vertebrae.
    weights
        Weights of the knots, shape (q, m).
    amplitude
        Standard deviation of the smooth part, one per component, shape (3,).
    irregularity
        Standard deviation of the deviation of each vertebra from it.
    correlation_levels
        Distance over which the smooth part is alike, levels.

    Returns
    -------
    Float
        Errors of the components, shape (q, 3, r): columns are independent unit errors.

    References
    ----------
    The error of a value f is ``f - W f_knots``; its covariance follows from that of the values, which is squared
    exponential (Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), section 4.2).
    """
    q = len(at)
    order = np.concatenate([at, knots])
    residual = np.concatenate([np.eye(q), -weights], axis=1)
    distance = np.subtract.outer(places[order], places[order]) / correlation_levels
    smooth = residual @ np.exp(-0.5 * distance**2) @ residual.T
    irregular = irregularity**2 * residual @ residual.T
    factors = covariance_factor(amplitude[:, None, None] ** 2 * smooth + irregular)
    factor = np.zeros((q, 3, 3 * q))
    for axis in range(3):
        factor[:, axis, axis * q : (axis + 1) * q] = factors[axis]
    return factor
