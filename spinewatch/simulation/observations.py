"""What a detector reports of triads in two images: true features with noise, and false ones."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from spinewatch.arrays import Float
from spinewatch.camera import Camera, Rig
from spinewatch.detection.features import Features
from spinewatch.markers import FLAT_10_14_18, TriadModel
from spinewatch.triads.pose import Pose

Side = Literal["left", "right"]
HiddenImage = tuple[int, Side]
"""A ball's number and the view that does not show it."""


@dataclass(frozen=True)
class Noise:
    """How features differ from the truth.

    ``sigma_px`` of every centre, per axis; ``common_sd_mrad`` of the pointing error that the balls of a triad
    share in a view; ``false_features`` an image, anywhere in it.
    """

    sigma_px: float = 0.3
    common_sd_mrad: float = 0.0
    false_features: int = 0


@dataclass(frozen=True, eq=False)
class Observation:
    """Features of both images; ``left_ball`` and ``right_ball`` tell each one's ball, -1 for a false one.

    Balls are numbered through the triads: ball b of triad t is ``3 t + b`` when all have three.
    """

    left: Features
    right: Features
    left_ball: NDArray[np.intp]
    right_ball: NDArray[np.intp]


def ball_centres(poses: Sequence[Pose], model: TriadModel = FLAT_10_14_18) -> Float:
    """Return the balls (t, n, 3) of triads of one model in object space, mm."""
    return np.stack([pose.position_mm + model.coordinates_mm @ pose.rotation.T for pose in poses])


def observe(
    rig: Rig,
    poses: Sequence[Pose],
    rng: np.random.Generator,
    noise: Noise | None = None,
    *,
    dropped: Collection[int] = (),
    hidden: Collection[HiddenImage] = (),
    models: Sequence[TriadModel] | None = None,
) -> Observation:
    """Return noisy features of every ball that is not ``dropped`` or ``hidden`` in a view, and false ones.

    ``models``, one a triad, are the flat marker when not given. Features that miss the image are left out,
    and every feature carries the covariance of its own error.
    """
    noise = noise or Noise()
    models = models or [FLAT_10_14_18] * len(poses)
    balls = [ball_centres([pose], model)[0] for pose, model in zip(poses, models, strict=True)]
    triad = np.repeat(np.arange(len(balls)), [len(b) for b in balls])
    centres = np.concatenate(balls) if balls else np.empty((0, 3))

    def view(camera: Camera, side: Side) -> tuple[Features, NDArray[np.intp]]:
        gone = {*dropped, *(ball for ball, where in hidden if where == side)}
        seen = np.array([ball for ball in range(len(centres)) if ball not in gone], dtype=np.intp)
        return _image(camera, centres[seen], seen, triad[seen], rng, noise)

    left, left_ball = view(rig.left, "left")
    right, right_ball = view(rig.right, "right")
    return Observation(left, right, left_ball, right_ball)


def _image(
    camera: Camera,
    centres: Float,
    ball: NDArray[np.intp],
    triad: NDArray[np.intp],
    rng: np.random.Generator,
    noise: Noise,
) -> tuple[Features, NDArray[np.intp]]:
    own = noise.sigma_px * rng.standard_normal((len(centres), 2))
    shared = rng.standard_normal((int(triad.max(initial=-1)) + 1, 2))
    shared *= camera.focal_length_mm * noise.common_sd_mrad / 1000 / np.array(camera.pixel_size_mm)
    true_px = camera.project(centres) + own + shared[triad]
    false_px = rng.uniform((0, 0), camera.image_size_px, (noise.false_features, 2))
    score = np.concatenate([rng.beta(8, 3, len(true_px)), rng.beta(4, 4, len(false_px))])
    number = np.concatenate([ball, np.full(len(false_px), -1)])
    xy = np.concatenate([true_px, false_px])
    inside = np.all((xy >= 0) & (xy <= np.array(camera.image_size_px) - 1), axis=1)
    order = np.argsort(-score, kind="stable")
    order = order[inside[order]]
    return Features.with_sigma(xy[order], score[order], max(noise.sigma_px, 1e-3)), number[order]
