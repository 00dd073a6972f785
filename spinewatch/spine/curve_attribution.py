"""How much of a change of the Cobb angle came with rotation of the curve's plane and how much with straightening."""

from __future__ import annotations

from itertools import product

import numpy as np

from spinewatch.arrays import Float

_SHARES = {0: 1 / 3, 1: 1 / 6, 2: 1 / 3}
"""Weight of the effect of one of three causes, by how many of the others have acted before it."""


def cobb_shares(upper_before: Float, lower_before: Float, upper_after: Float, lower_after: Float) -> Float:
    """Return the change of the Cobb angle and its parts.

    Parameters
    ----------
    upper_before, lower_before, upper_after, lower_after
        Unit vectors z of the upper and lower end vertebra at the earlier and the later stage, shape (..., 3), patient
        axes.

    Returns
    -------
    Float
        Shape (..., 4), degrees: the change; the part of rotation, of the azimuth of the plane of maximum curvature; the
        part of distraction, of the curve's size (straightening); the part of the common tilt of both end vertebrae.
        The first is the sum of the others.

    References
    ----------
    The horizontal part of ``z_upper - z_lower`` has a length, the size of the curve, and an azimuth, its plane; with
    the mean of both in the axes of that plane they determine both z, and so the Cobb angle. The change is divided among
    the three by the value of L. S. Shapley, "A value for n-person games" (1953): the effect of each, averaged over the
    orders in which they may have acted. So the parts add up, and before and after may change places.

    Examples
    --------
    A kyphosis of 60 degrees that was turned out of the coronal plane, without a change of its form:

    >>> def z(azimuth: float, tilt: float) -> Float:
    ...     a, t = np.radians([azimuth, tilt])
    ...     return np.array([np.sin(t) * np.cos(a), np.sin(t) * np.sin(a), np.cos(t)])
    >>> cobb_shares(z(90, 30), z(90, -30), z(0, 30), z(0, -30)).round(9) + 0.0
    array([-60., -60.,   0.,   0.])
    """
    size, azimuth, middle = zip(
        _plane(upper_before, lower_before), _plane(upper_after, lower_after), strict=True
    )
    cobb = {
        stages: _cobb(size[stages[0]], azimuth[stages[1]], middle[stages[2]])
        for stages in product((0, 1), repeat=3)
    }
    parts = [np.zeros(np.shape(size[0])) for _ in range(3)]
    for stages, value in cobb.items():
        for cause in range(3):
            acted = sum(stages) - stages[cause]
            parts[cause] = parts[cause] + (1 if stages[cause] else -1) * _SHARES[acted] * value
    straightening, rotation, tilt = parts
    return np.stack([cobb[1, 1, 1] - cobb[0, 0, 0], rotation, straightening, tilt], axis=-1)


def _plane(upper: Float, lower: Float) -> tuple[Float, Float, Float]:
    """Return size, azimuth (radians) and the mean of both horizontal parts as a complex number in the plane's axes."""
    high, low = upper[..., 0] + 1j * upper[..., 1], lower[..., 0] + 1j * lower[..., 1]
    d = high - low
    azimuth = np.angle(d)
    return np.abs(d), azimuth, (high + low) / 2 * np.exp(-1j * azimuth)


def _cobb(size: Float, azimuth: Float, middle: Float) -> Float:
    """Return the Cobb angle of two z that lie above the horizontal plane, degrees."""
    turn = np.exp(1j * azimuth)
    high, low = (middle + size / 2) * turn, (middle - size / 2) * turn
    return _tilt(low) - _tilt(high)


def _tilt(horizontal: Float) -> Float:
    """Return the coronal tilt of a unit vector from its horizontal part, degrees."""
    upright = np.sqrt(np.maximum(1.0 - np.abs(horizontal) ** 2, 0.0))
    return np.asarray(np.degrees(np.arctan2(-horizontal.imag, upright)))
