"""Rows of triads as a surgeon leaves them along a spine."""

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
    """Return true poses (zero covariance) of a row of triads in order along an object axis.

    Gaps are ``steps`` (count - 1, all 1 when not given) times the spacing and vary by a tenth; the row turns
    by ``bend_deg`` from end to end beside waves of several mm; normals tilt about Z with a standard deviation
    per axis, and each triad points anywhere in its plane.
    """
    along = int(axis == "y")
    gaps = spacing_mm * np.asarray(steps if steps is not None else np.ones(count - 1))
    gaps = gaps * (1 + 0.1 * rng.standard_normal(count - 1))
    s = np.concatenate([[0.0], np.cumsum(gaps)])
    turn = np.radians(bend_deg) * ((s[:-1] + s[1:]) / 2 / max(s[-1], 1.0) - 0.5)
    row = np.zeros((count, 2))
    row[1:, 0], row[1:, 1] = np.cumsum(gaps * np.cos(turn)), np.cumsum(gaps * np.sin(turn))
    row -= row.mean(axis=0)
    P = np.tile(np.array(centre_mm), (count, 1))
    P[:, along] += row[:, 0]
    P[:, 1 - along] += row[:, 1]
    P[:, 1 - along] += 10 * np.sin(s / 60 + rng.uniform(0, 2 * np.pi)) + 2 * rng.standard_normal(count)
    P[:, 2] += 5 * np.sin(s / 80 + rng.uniform(0, 2 * np.pi)) + 2 * rng.standard_normal(count)
    return tuple(Pose(p, random_rotation(rng, tilt_sd_deg), np.zeros((6, 6))) for p in P)


def random_rotation(rng: np.random.Generator, tilt_sd_deg: float) -> Float:
    """Return a rotation (3, 3) that tilts z with a standard deviation per axis and turns anywhere about it."""
    tilt = np.append(np.radians(tilt_sd_deg) * rng.standard_normal(2), 0.0)
    turn = np.array([0.0, 0.0, rng.uniform(-np.pi, np.pi)])
    return np.asarray(rotation_from_vector(tilt) @ rotation_from_vector(turn))
