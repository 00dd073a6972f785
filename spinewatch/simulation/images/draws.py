"""Random numbers and directions of random worlds."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Single


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Return a number whose logarithm is uniform.

    Parameters
    ----------
    rng
        Source of random numbers.
    low, high
        Limits.

    Returns
    -------
    float
        The number.
    """
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def unit_vector(from_z_rad: float, azimuth_rad: float) -> Single:
    """Return a unit vector at an angle to z.

    Parameters
    ----------
    from_z_rad
        Angle to z, radians.
    azimuth_rad
        Angle of its (x, y) part to x, radians.

    Returns
    -------
    Single
        The vector, shape (3,).
    """
    s = np.sin(from_z_rad)
    return np.array([s * np.cos(azimuth_rad), s * np.sin(azimuth_rad), np.cos(from_z_rad)], np.float32)


def near(rng: np.random.Generator, direction: Single, sd_deg: float) -> Single:
    """Return a unit vector near another one.

    Parameters
    ----------
    rng
        Source of random numbers.
    direction
        The other one, shape (3,).
    sd_deg
        Standard deviation per axis, degrees.

    Returns
    -------
    Single
        The vector, shape (3,).
    """
    away = direction + rng.normal(0, np.radians(sd_deg), 3).astype(np.float32)
    return np.asarray(away / np.linalg.norm(away), dtype=np.float32)


def leaning(rng: np.random.Generator, up: Single, low_deg: float, high_deg: float) -> Single:
    """Return a unit vector at a random angle to another one.

    Parameters
    ----------
    rng
        Source of random numbers.
    up
        The other one, shape (3,).
    low_deg, high_deg
        Limits of the angle, degrees.

    Returns
    -------
    Single
        The vector, shape (3,).
    """
    aside = np.cross(up, rng.standard_normal(3))
    aside /= np.linalg.norm(aside)
    lean = np.radians(rng.uniform(low_deg, high_deg))
    return np.asarray(np.cos(lean) * up + np.sin(lean) * aside, dtype=np.float32)


def beside(rng: np.random.Generator, distance: float, height: float) -> Single:
    """Return a point beside the origin.

    Parameters
    ----------
    rng
        Source of random numbers.
    distance
        Distance in the image.
    height
        Coordinate z.

    Returns
    -------
    Single
        The point, shape (3,).
    """
    azimuth = rng.uniform(0, 2 * np.pi)
    return np.array([distance * np.cos(azimuth), distance * np.sin(azimuth), height], np.float32)
