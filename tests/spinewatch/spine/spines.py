"""Simulated spines with known poses, for tests of measures, changes and attribution."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.spine.configuration import Origin, SpineConfiguration, SpinePoses
from spinewatch.spine.orientation import rotation_from_tilts

LEVELS = tuple(f"T{i}" for i in range(1, 13)) + tuple(f"L{i}" for i in range(1, 6))


def configuration(
    levels: Sequence[str],
    position_mm: Float,
    rotation: Float,
    errors: Mapping[str, Float] | None = None,
    marked: Sequence[str] | None = None,
) -> SpineConfiguration:
    """A spine whose levels are all measured."""
    n = len(levels)
    return SpineConfiguration(
        levels=tuple(levels),
        marked=tuple(marked is None or level in marked for level in levels),
        origins=(Origin.MEASURED,) * n,
        reasons=(None,) * n,
        poses=SpinePoses(np.asarray(position_mm, dtype=float), np.asarray(rotation, dtype=float)),
        errors=dict(errors or {}),
    )


def tilted(
    coronal_deg: Sequence[float] | Float,
    sagittal_deg: Sequence[float] | Float | float = 0.0,
    axial_deg: Sequence[float] | Float | float = 0.0,
    levels: Sequence[str] | None = None,
    spacing_mm: float = 25.0,
) -> SpineConfiguration:
    """A spine of given tilts, cranial first, whose centroids follow the z axes; the last one is at the origin."""
    coronal = np.asarray(coronal_deg, dtype=float)
    rotation = rotation_from_tilts(
        coronal, np.broadcast_to(sagittal_deg, coronal.shape), np.broadcast_to(axial_deg, coronal.shape)
    )
    z = rotation[..., 2]
    steps = spacing_mm * (z[:-1] + z[1:]) / 2
    position = np.concatenate([np.cumsum(steps[::-1], axis=0)[::-1], np.zeros((1, 3))])
    return configuration(levels or LEVELS[-len(coronal) :], position, rotation)


def scoliosis(bend: float = 1.0, turn: float = 1.0, kyphosis: float = 1.0) -> SpineConfiguration:
    """T1 to L5 with a right thoracic curve of 55 degrees and a left lumbar one of 38 degrees, for ``bend`` 1."""
    level = np.arange(17.0)
    coronal = bend * (_wave(level, -8.0, -27.0, 4.0) + _wave(level, -27.0, 28.0, 11.0, 4.0) + _last(level))
    sagittal = kyphosis * np.where(level < 12, 22.0 - 3.7 * level, -22.0 + 5.5 * (level - 12))
    axial = turn * (-14.0 * np.exp(-((level - 7.5) ** 2) / 8) + 9.0 * np.exp(-((level - 14) ** 2) / 5))
    return tilted(coronal, sagittal, axial)


def _wave(level: Float, start: float, end: float, stop: float, begin: float = 0.0) -> Float:
    phase = np.clip((level - begin) / (stop - begin), 0, 1)
    inside = (level >= begin) & (level < stop)
    return np.where(inside, (start + end) / 2 + (start - end) / 2 * np.cos(np.pi * phase), 0.0)


def _last(level: Float) -> Float:
    return np.where(level >= 11, 9.0 + 19.0 * np.cos(np.pi * (level - 11) / 5), 0.0)


def errors(n: int, position_sd_mm: float = 0.3, rotation_sd_deg: float = 1.0) -> Float:
    """Independent errors of n vertebrae, shape (n, 6, 6 n)."""
    sd = np.array([position_sd_mm] * 3 + [rotation_sd_deg] * 3)
    return np.diag(np.tile(sd, n)).reshape(n, 6, 6 * n)


def disturbed(
    truth: SpineConfiguration, factors: Mapping[str, Float], units: Mapping[str, Float]
) -> SpineConfiguration:
    """The measured spine of a true one: its errors are the factors times unit errors, ``R_true = Exp(e) R``."""
    e = np.sum([factors[source] @ units[source] for source in factors], axis=0)
    poses = SpinePoses(
        truth.poses.position_mm - e[:, :3],
        rotation_from_vector(np.radians(-e[:, 3:])) @ truth.poses.rotation,
    )
    return replace(truth, poses=poses, errors=dict(factors))
