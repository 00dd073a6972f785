"""Simulated breathing: how the vertebrae of a prone patient rise and fall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.simulation.scoliosis import LEVELS
from spinewatch.spine.configuration import SpinePoses

_APEX = LEVELS.index("T8")


@dataclass(frozen=True)
class BreathingParameters:
    """A regular breath.

    Attributes
    ----------
    rise_mm
        How far the vertebra that moves most rises with a breath, mm.
    per_minute
        Breaths a minute.
    phase
        Part of a breath that has passed at time 0, 0 to 1.
    width_levels
        Width of the part of the spine that rises, in levels: a Gaussian about T8.
    exponent
        Exponent of the cosine; larger values dwell longer at the end of expiration.

    References
    ----------
    A. E. Lujan et al., Med. Phys. 26 (1999) 715, eq. 1, for the course in time; 2.0 +- 1.3 mm per breath: PMC6686387.
    """

    rise_mm: float = 2.0
    per_minute: float = 15.0
    phase: float = 0.0
    width_levels: float = 5.0
    exponent: int = 6


def breath_course(times_s: Float, parameters: BreathingParameters | None = None) -> Float:
    """Return how far a breath has come, 0 at the end of expiration and 1 at the end of inspiration.

    Parameters
    ----------
    times_s
        Times, shape (...), s.
    parameters
        The breath; the default one if None.

    Returns
    -------
    Float
        Shares of the rise, shape (...).

    Examples
    --------
    >>> import numpy as np
    >>> breath_course(np.array([0.0, 2.0, 4.0])).round(6)
    array([1., 0., 1.])
    """
    p = parameters or BreathingParameters()
    cosine = np.cos(np.pi * (np.asarray(times_s) * p.per_minute / 60 + p.phase))
    return np.asarray(cosine**p.exponent)


def mean_breath_course(parameters: BreathingParameters | None = None) -> float:
    """Return the mean of `breath_course` over a breath.

    Parameters
    ----------
    parameters
        The breath; the default one if None.

    Returns
    -------
    float
        Mean share of the rise.

    Examples
    --------
    >>> round(mean_breath_course(), 6)
    0.3125
    """
    p = parameters or BreathingParameters()
    period = 60 / p.per_minute
    return float(breath_course(np.arange(64) * period / 64, p).mean())


def breathed(poses: SpinePoses, share: float, parameters: BreathingParameters | None = None) -> SpinePoses:
    """Return the poses of a spine at a moment of a breath.

    The vertebrae move to the posterior side and tilt with the slope of their displacements along the spine.

    Parameters
    ----------
    poses
        Poses of all ``LEVELS`` at the end of expiration, patient axes.
    share
        Share of the rise, of `breath_course`.
    parameters
        The breath; the default one if None.

    Returns
    -------
    SpinePoses
        Poses at that moment, patient axes.
    """
    p = parameters or BreathingParameters()
    offset = (np.arange(len(LEVELS)) - _APEX) / p.width_levels
    rise = share * p.rise_mm * np.exp(-(offset**2) / 2)
    moved = poses.position_mm.copy()
    moved[:, 0] -= rise
    slope = np.gradient(-rise, poses.position_mm[:, 2])
    tilt = np.zeros((len(LEVELS), 3))
    tilt[:, 1] = np.arctan(slope)
    return SpinePoses(moved, rotation_from_vector(tilt) @ poses.rotation)
