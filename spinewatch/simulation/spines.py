"""Random chains of triads along a spine."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.simulation.rigs import MEASURING_VOLUME_CENTRE_MM
from spinewatch.triads.pose import Pose


def random_spine(
    rng: np.random.Generator,
    count: int = 4,
    *,
    axis: Literal["x", "y"] = "x",
    spacing_mm: float = 50.0,
    steps: Sequence[float] | None = None,
    bend_deg: float = 0.0,
    tilt_sd_deg: float = 12.0,
    centre_mm: tuple[float, float, float] = MEASURING_VOLUME_CENTRE_MM,
) -> tuple[Pose, ...]:
    """Return random poses of triads in order along an object axis.

    The chain undulates by several mm across the axis and in height; distances vary by a tenth; the azimuth of each
    triad in its plane is uniformly distributed.

    Parameters
    ----------
    rng
        Source of random numbers.
    count
        Number of triads.
    axis
        Object axis along the spine.
    spacing_mm
        Distance between vertebrae, mm.
    steps
        Distance from each triad to the next as a multiple of the spacing, ``count - 1`` numbers; by default 1.
    bend_deg
        Change of direction of the chain from end to end, degrees.
    tilt_sd_deg
        Standard deviation of the tilt of the normals against Z, per axis, degrees.
    centre_mm
        Middle of the chain, object space, mm.

    Returns
    -------
    tuple of Pose
        True poses, with zero covariance.

    Examples
    --------
    >>> poses = random_spine(np.random.default_rng(0), 3)
    >>> [bool(a.position_mm[0] < b.position_mm[0]) for a, b in zip(poses, poses[1:])]
    [True, True]
    """
    along = int(axis == "y")
    gaps = spacing_mm * np.asarray(steps if steps is not None else np.ones(count - 1))
    gaps = gaps * (1 + 0.1 * rng.standard_normal(count - 1))
    s = np.concatenate([[0.0], np.cumsum(gaps)])
    direction = np.radians(bend_deg) * ((s[:-1] + s[1:]) / 2 / max(s[-1], 1.0) - 0.5)
    chain = np.zeros((count, 2))
    chain[1:, 0], chain[1:, 1] = np.cumsum(gaps * np.cos(direction)), np.cumsum(gaps * np.sin(direction))
    chain -= chain.mean(axis=0)
    P = np.tile(np.array(centre_mm), (count, 1))
    P[:, along] += chain[:, 0]
    P[:, 1 - along] += chain[:, 1]
    P[:, 1 - along] += 10 * np.sin(s / 60 + rng.uniform(0, 2 * np.pi)) + 2 * rng.standard_normal(count)
    P[:, 2] += 5 * np.sin(s / 80 + rng.uniform(0, 2 * np.pi)) + 2 * rng.standard_normal(count)
    return tuple(Pose(p, random_rotation(rng, tilt_sd_deg), np.zeros((6, 6))) for p in P)


def random_rotation(rng: np.random.Generator, tilt_sd_deg: float) -> Float:
    """Return a random rotation of a triad: a tilt of its normal after a rotation about it by any angle.

    Parameters
    ----------
    rng
        Source of random numbers.
    tilt_sd_deg
        Standard deviation of the tilt, per axis, degrees.

    Returns
    -------
    Float
        Rotation from triad to object axes, shape (3, 3).
    """
    tilt = np.append(np.radians(tilt_sd_deg) * rng.standard_normal(2), 0.0)
    azimuth = np.array([0.0, 0.0, rng.uniform(-np.pi, np.pi)])
    return np.asarray(rotation_from_vector(tilt) @ rotation_from_vector(azimuth))
