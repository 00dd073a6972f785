"""Measured poses of simulated triads: noisy ball centres with known correspondence, many triads at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bench.scoring import rms
from bench.tables import Bar, Grid
from spinewatch.arrays import Float
from spinewatch.camera import Camera, Rig
from spinewatch.detection.features import HIDDEN, Features
from spinewatch.geometry.rotations import vector_from_rotation
from spinewatch.markers import FLAT_10_14_18
from spinewatch.simulation.observations import FeatureNoise, observe
from spinewatch.simulation.rigs import large_rig
from spinewatch.simulation.spines import random_spine
from spinewatch.triads.pose import Pose
from spinewatch.triads.pose_adjustment import adjust_poses, triad_images

RIG_NOISE = FeatureNoise(sigma_px=0.1, common_sd_mrad=0.12)
"""Errors of ball centres on the cart."""

_AT_ONCE = 3000
_CHI2_95_3, _CHI2_95_6 = 7.815, 12.592


def measured_triads(
    rig: Rig,
    poses: Sequence[Pose],
    rng: np.random.Generator,
    noise: FeatureNoise = RIG_NOISE,
    pointing: Float | None = None,
) -> list[Pose | None]:
    """Return the measured pose of each triad with its covariance; None where a ball lies outside an image.

    ``pointing`` are the pointing errors that the balls of each triad share, (t, 2, 2): in the left and in the right
    view, in units of their standard deviation; they are drawn if None.
    """
    found: list[Pose | None] = []
    for first in range(0, len(poses), _AT_ONCE):
        part = slice(first, first + _AT_ONCE)
        found += _measured(rig, poses[part], rng, noise, None if pointing is None else pointing[part])
    return found


def _measured(
    rig: Rig, poses: Sequence[Pose], rng: np.random.Generator, noise: FeatureNoise, pointing: Float | None
) -> list[Pose | None]:
    own = noise if pointing is None else replace(noise, common_sd_mrad=0.0)
    seen = observe(rig, poses, rng, own)
    left, right = seen.left, seen.right
    if pointing is not None:
        sd_mrad = noise.common_sd_mrad
        left = _shifted(left, rig.left, sd_mrad * pointing[seen.left_ball // 3, 0])
        right = _shifted(right, rig.right, sd_mrad * pointing[seen.right_ball // 3, 1])
    index = []
    for ball in (seen.left_ball, seen.right_ball):
        places = np.full(3 * len(poses), HIDDEN)
        places[ball] = np.arange(len(ball))
        index.append(places.reshape(-1, 3))
    complete = np.all((index[0] != HIDDEN) & (index[1] != HIDDEN), axis=1)
    members = np.flatnonzero(complete).tolist()
    if not members:
        return [None] * len(poses)
    images = [
        triad_images(features.rays(camera), places[complete], noise.common_sd_mrad)
        for features, camera, places in zip((left, right), (rig.left, rig.right), index, strict=True)
    ]
    start = np.stack([poses[i].position_mm for i in members]), np.stack([poses[i].rotation for i in members])
    fit = adjust_poses(FLAT_10_14_18.coordinates_mm, images, *start)
    place = {triad: number for number, triad in enumerate(members)}
    return [fit.pose(place[i]) if i in place else None for i in range(len(poses))]


def _shifted(features: Features, camera: Camera, pointing_mrad: Float) -> Features:
    """Return features with pointing errors (n, 2), mrad."""
    shift = camera.focal_length_mm * pointing_mrad / 1000 / np.array(camera.pixel_size_mm)
    return Features(features.xy_px + shift, features.score, features.covariance_px2)


def pose_errors(true: Pose, pose: Pose) -> Float:
    """Return the error of a pose in the convention of its covariance, shape (6,), mm and degrees."""
    rotation = np.degrees(vector_from_rotation(true.rotation @ pose.rotation.T))
    return np.concatenate([true.position_mm - pose.position_mm, rotation])


def pose_coverage(count: int) -> tuple[list[Grid], tuple[Bar, ...]]:
    """Return how well the covariances of ``count`` measured triads describe their errors."""
    rng = np.random.default_rng([12, 0])
    true = [pose for _ in range(max(count // 4, 1)) for pose in random_spine(rng)]
    pairs = [
        (t, m) for t, m in zip(true, measured_triads(large_rig(), true, rng), strict=True) if m is not None
    ]
    errors = np.stack([pose_errors(t, m) for t, m in pairs])
    S = np.stack([m.covariance for _, m in pairs])
    shares = []
    for part, limit in ((slice(0, 3), _CHI2_95_3), (slice(3, 6), _CHI2_95_3), (slice(0, 6), _CHI2_95_6)):
        e = errors[:, part]
        chi2 = np.einsum("ni,ni->n", e, np.linalg.solve(S[:, part, part], e[..., None])[..., 0])
        shares.append(100 * float(np.mean(chi2 <= limit)))
    row = (
        len(pairs),
        f"{rms(np.linalg.norm(errors[:, :3], axis=1)):.3f}",
        f"{rms(np.linalg.norm(errors[:, 3:], axis=1)):.3f}",
        *(f"{share:.1f}" for share in shares),
    )
    columns = ["triads", "P mm", "rotation deg", "P in 95%", "rotation in 95%", "both in 95%"]
    title = "Simulated triads: 0.1 px, 0.12 mrad shared by the balls of a triad in a view"
    promise = "poses of simulated triads lie in their 95% regions in 93-97%"
    reached = ", ".join(f"{share:.1f}%" for share in shares)
    bar = Bar(promise, reached, all(93 <= share <= 97 for share in shares))
    return [Grid.of(title, columns, [row])], (bar,)
