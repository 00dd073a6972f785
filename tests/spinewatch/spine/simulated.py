"""Random surgeries of the thoracolumbar spine with known motions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.spine.configuration import InitialKind, InitialSpine, SpinePoses, SpineSetup
from spinewatch.triads.pose import Pose

LEVELS = ("T8", "T9", "T10", "T11", "T12", "L1", "L2", "L3")
AXES = np.column_stack([[0.0, 0, -1], [0, -1, 0], [-1, 0, 0]])
"""Patient axes of a prone patient with the head along -x."""


@dataclass(frozen=True, eq=False)
class Surgery:
    """A setup, the stages that it was made for, and the true poses at each in patient axes of the baseline."""

    setup: SpineSetup
    stages: Mapping[str, Mapping[str, Pose]]
    truth: Mapping[str, SpinePoses]


def turn(x_deg: float, y_deg: float, z_deg: float) -> Float:
    """Return the rotation of a rotation vector in degrees."""
    return rotation_from_vector(np.radians([x_deg, y_deg, z_deg]))


def poses_of(position: Float, rotation: Float, covariance: Float | None = None) -> Pose:
    """Return a pose, without errors unless a covariance is given."""
    return Pose(position, rotation, np.zeros((6, 6)) if covariance is None else covariance)


def moved(pose: Pose, R: Float, t: Float) -> Pose:
    """Return a pose in object space that was turned and shifted."""
    Q = np.zeros((6, 6))
    Q[:3, :3] = Q[3:, 3:] = R
    return Pose(R @ pose.position_mm + t, R @ pose.rotation, Q @ pose.covariance @ Q.T)


def disturbed(pose: Pose, error: Float) -> Pose:
    """Return a pose with an error (6,), mm and degrees."""
    return Pose(pose.position_mm + error[:3], turn(*error[3:]) @ pose.rotation, pose.covariance)


def covariance_of(rng: np.random.Generator, size: float) -> Float:
    """Return a random covariance of a pose with deviations of about a size in mm and degrees."""
    A = rng.normal(0, size, (6, 6))
    return np.asarray(A @ A.T / 6)


def surgery(
    seed: int,
    marked: Sequence[str] = LEVELS,
    stages: Sequence[str] = ("PRE", "INTER", "POST"),
    *,
    reference: str = "L1",
    motion_deg: float = 12.0,
    noise: float = 0.0,
    initial_sd: float = 0.0,
) -> Surgery:
    """Return a surgery with smooth motions; the reference vertebra stays, while the cart moves between the stages."""
    rng = np.random.default_rng(seed)
    n = len(LEVELS)
    position = np.column_stack([rng.normal(0, 5, n), rng.normal(0, 15, n), -30.0 * np.arange(n)])
    rotation = rotation_from_vector(np.radians(rng.normal(0, 8, (n, 3))))
    i = LEVELS.index(reference)
    position -= position[i]
    truth, labelled = {}, {}
    mounts = {
        name: (rng.normal([-45, 0, 0], 5), rotation_from_vector(rng.normal(0, 0.3, 3))) for name in marked
    }
    for number, stage in enumerate(stages):
        away = (np.arange(n) - i)[:, None] / n
        turns = rotation_from_vector(np.radians(number * motion_deg * away * rng.normal(1, 0.3, 3)))
        truth[stage] = SpinePoses(position + number * 10 * away * rng.normal(1, 0.3, 3), turns @ rotation)
        labelled[stage] = {
            name: poses_of(
                np.array([20.0, 30, 900])
                + AXES @ (truth[stage].position_mm[j] + truth[stage].rotation[j] @ mounts[name][0]),
                AXES @ truth[stage].rotation[j] @ mounts[name][1],
                covariance_of(rng, noise),
            )
            for j, name in enumerate(LEVELS)
            if name in marked
        }
    cart = {stage: (turn(*rng.uniform(-6, 6, 3)), rng.uniform(-60, 60, 3)) for stage in stages[1:]}
    initial = InitialSpine(
        InitialKind.POSES,
        LEVELS,
        np.array([20.0, 30, 900]) + position @ AXES.T,
        AXES @ rotation,
        np.reshape(initial_sd * rng.normal(size=(6 * n, 6 * n)) / np.sqrt(6 * n), (n, 6, 6 * n)),
    )
    shown = {
        stage: {name: moved(pose, *cart[stage]) if stage in cart else pose for name, pose in poses.items()}
        for stage, poses in labelled.items()
    }
    return Surgery(SpineSetup(AXES, reference, stages[0], initial), shown, truth)
