"""Rows of triads as a surgeon leaves them along a spine."""

from __future__ import annotations

from typing import Literal

import numpy as np

from spinewatch.camera import Float
from spinewatch.simulation.rigs import MEASURING_VOLUME_CENTRE_MM
from spinewatch.triads.pose import Pose, rotation_from_vector


def random_spine(
    rng: np.random.Generator,
    count: int = 4,
    *,
    axis: Literal["x", "y"] = "x",
    spacing_mm: float = 50.0,
    tilt_sd_deg: float = 12.0,
    centre_mm: tuple[float, float, float] = MEASURING_VOLUME_CENTRE_MM,
) -> tuple[Pose, ...]:
    """Return true poses (zero covariance) of a row of triads in order along an object axis.

    Gaps vary by a tenth of the spacing, the row bends by several mm, normals tilt about Z with a standard
    deviation per axis, and each triad points anywhere in its plane.
    """
    along = int(axis == "y")
    gaps = spacing_mm * (1 + 0.1 * rng.standard_normal(count - 1))
    s = np.concatenate([[0.0], np.cumsum(gaps)])
    P = np.tile(np.array(centre_mm), (count, 1))
    P[:, along] += s - s.mean()
    P[:, 1 - along] += 10 * np.sin(s / 60 + rng.uniform(0, 2 * np.pi)) + 2 * rng.standard_normal(count)
    P[:, 2] += 5 * np.sin(s / 80 + rng.uniform(0, 2 * np.pi)) + 2 * rng.standard_normal(count)
    return tuple(Pose(p, _random_rotation(rng, tilt_sd_deg), np.zeros((6, 6))) for p in P)


def _random_rotation(rng: np.random.Generator, tilt_sd_deg: float) -> Float:
    tilt = np.append(np.radians(tilt_sd_deg) * rng.standard_normal(2), 0.0)
    turn = np.array([0.0, 0.0, rng.uniform(-np.pi, np.pi)])
    return np.asarray(rotation_from_vector(tilt) @ rotation_from_vector(turn))
