"""What a detector reports of triads in two images: true features with noise, and false ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from spinewatch.camera import Camera, Float, Rig
from spinewatch.features import Features
from spinewatch.triads.model import FLAT_10_14_18, TriadModel
from spinewatch.triads.pose import Pose


@dataclass(frozen=True, eq=False)
class Observation:
    """Features of both images; ``left_ball`` and ``right_ball`` tell each one's ball, -1 for a false one.

    Ball ``3 t + b`` is ball b of triad t.
    """

    left: Features
    right: Features
    left_ball: NDArray[np.intp]
    right_ball: NDArray[np.intp]


def ball_centres(poses: Sequence[Pose], model: TriadModel = FLAT_10_14_18) -> Float:
    """Return the balls (t, 3, 3) of triads in object space, mm."""
    return np.stack([pose.position_mm + model.coordinates_mm @ pose.rotation.T for pose in poses])


def observe(
    rig: Rig,
    poses: Sequence[Pose],
    rng: np.random.Generator,
    *,
    sigma_px: float = 0.3,
    false_features: int = 0,
    dropped: Sequence[int] = (),
    model: TriadModel = FLAT_10_14_18,
) -> Observation:
    """Return noisy features of every ball that is not ``dropped``, and false ones all over the image."""
    balls = ball_centres(poses, model).reshape(-1, 3)
    kept = np.setdiff1d(np.arange(len(balls)), np.asarray(dropped, dtype=np.intp))

    def image(camera: Camera) -> tuple[Features, NDArray[np.intp]]:
        true_px = camera.project(balls[kept]) + sigma_px * rng.standard_normal((len(kept), 2))
        false_px = rng.uniform((0, 0), camera.image_size_px, (false_features, 2))
        score = np.concatenate([rng.beta(8, 3, len(kept)), rng.beta(4, 4, false_features)])
        ball = np.concatenate([kept, np.full(false_features, -1)])
        order = np.argsort(-score, kind="stable")
        xy = np.concatenate([true_px, false_px])
        return Features.with_sigma(xy[order], score[order], max(sigma_px, 1e-3)), ball[order]

    (left, left_ball), (right, right_ball) = image(rig.left), image(rig.right)
    return Observation(left, right, left_ball, right_ball)
