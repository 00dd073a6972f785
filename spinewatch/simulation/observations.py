"""Simulated features of triads in two images: true ones with noise, and false ones."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.camera import Camera, Rig
from spinewatch.detection.features import Features
from spinewatch.imaging.frame import Side
from spinewatch.markers import FLAT_10_14_18, TriadModel
from spinewatch.triads.pose import Pose, ball_centres

HiddenBall = tuple[int, Side]
"""Number of a ball, and the view in which it is hidden."""


@dataclass(frozen=True)
class FeatureNoise:
    """Errors of simulated features.

    Attributes
    ----------
    sigma_px
        Standard deviation of every centre, per axis, px.
    common_sd_mrad
        Standard deviation of the pointing error that the balls of a triad share in a view, per axis, mrad.
    false_features
        Number of false features per image, uniformly distributed over it.
    """

    sigma_px: float = 0.3
    common_sd_mrad: float = 0.0
    false_features: int = 0


@dataclass(frozen=True, eq=False)
class Observation:
    """Features of both images with the ball of each.

    Balls are numbered in the order of the triads: ball b of triad t is ``3 t + b`` when all triads have three.

    Attributes
    ----------
    left, right
        Features, best score first.
    left_ball, right_ball
        Number of each feature's ball, shape (n,); -1 for a false feature.
    """

    left: Features
    right: Features
    left_ball: Int
    right_ball: Int


def observe(
    rig: Rig,
    poses: Sequence[Pose],
    rng: np.random.Generator,
    noise: FeatureNoise | None = None,
    *,
    dropped: Collection[int] = (),
    hidden: Collection[HiddenBall] = (),
    models: Sequence[TriadModel] | None = None,
) -> Observation:
    """Return simulated features of triads; those outside the image are omitted.

    Parameters
    ----------
    rig
        The cameras.
    poses
        True pose of each triad.
    rng
        Source of random numbers.
    noise
        Errors of the features. Every feature carries the covariance of its own error.
    dropped
        Balls without a feature in either view.
    hidden
        Balls without a feature in one view.
    models
        Marker of each triad; by default the flat one.

    Returns
    -------
    Observation
        Features of both images.

    Examples
    --------
    >>> from spinewatch.simulation.rigs import large_rig
    >>> from spinewatch.simulation.spines import random_spine
    >>> rng = np.random.default_rng(0)
    >>> observation = observe(large_rig(), random_spine(rng, 3), rng, hidden=[(4, "left")])
    >>> len(observation.left), len(observation.right)
    (8, 9)
    """
    noise = noise or FeatureNoise()
    models = models or [FLAT_10_14_18] * len(poses)
    balls = [ball_centres([pose], model)[0] for pose, model in zip(poses, models, strict=True)]
    triad = np.repeat(np.arange(len(balls)), [len(b) for b in balls])
    centres = np.concatenate(balls) if balls else np.empty((0, 3))

    def view(camera: Camera, side: Side) -> tuple[Features, Int]:
        omitted = {*dropped, *(ball for ball, hidden_side in hidden if hidden_side == side)}
        visible = np.array([ball for ball in range(len(centres)) if ball not in omitted], dtype=np.intp)
        return _features(camera, centres[visible], visible, triad[visible], rng, noise)

    left, left_ball = view(rig.left, "left")
    right, right_ball = view(rig.right, "right")
    return Observation(left, right, left_ball, right_ball)


def _features(
    camera: Camera, centres: Float, ball: Int, triad: Int, rng: np.random.Generator, noise: FeatureNoise
) -> tuple[Features, Int]:
    """Return the features of one image and the ball of each, of n centres (n, 3) with ball and triad numbers (n,)."""
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
