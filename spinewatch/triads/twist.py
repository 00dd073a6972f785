"""Poses whose turn about one axis the images hardly tell: the whole likelihood of that turn, not its peak.

Two balls in full view leave a triad free to turn about the line between them, and one view alone shows the
third ball moving to and fro along its sight: two turns may fit, or a whole range of them. The best pose with
the curvature there would promise too much. So the turn is stepped through, the other five parameters fitted
at each step, and position, rotation and covariance are the moments of what results.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector, vector_from_rotation
from spinewatch.triads.pose import Pose
from spinewatch.triads.pose_adjustment import TriadImages, adjust_poses

_FITS = 4
_STEPS = 73
_NEGLIGIBLE = 20.0  # of a logarithm of likelihood


@dataclass(frozen=True, eq=False)
class Tilt:
    """What is known of a marker's tilt beforehand: z points ``towards`` (3,) but for ``sd_deg`` per axis."""

    towards: Float
    sd_deg: float

    def log_prior(self, rotation: Float) -> Float:
        """Return the logarithm of the density (n,) of rotations (n, 3, 3), but for a constant."""
        cosine = rotation[:, :, 2] @ (self.towards / np.linalg.norm(self.towards))
        angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
        return np.asarray(-0.5 * (angle / self.sd_deg) ** 2)


def average_over_turn(
    model_mm: Float, views: Sequence[TriadImages], start: Pose, balls: tuple[int, int], tilt: Tilt
) -> Pose:
    """Return the mean pose of one marker and its covariance over all turns about the line of two ``balls``.

    ``views`` hold one marker each; ``start`` is a pose that fits them. The line's turn is tried within 80
    degrees, then finely where it is likely.
    """
    axis = start.rotation @ (model_mm[balls[1]] - model_mm[balls[0]])
    axis /= np.linalg.norm(axis)
    pivot = start.position_mm + start.rotation @ model_mm[balls[0]]
    turns = np.radians(np.linspace(-80, 80, _STEPS))
    for _ in range(2):
        R = rotation_from_vector(turns[:, None] * axis)
        P = pivot + (R @ (start.position_mm - pivot))
        many = [_repeated(view, len(turns)) for view in views]
        fit = adjust_poses(model_mm, many, P, R @ start.rotation, _FITS, np.tile(axis, (len(turns), 1)))
        likelihood = tilt.log_prior(fit.rotation) - 0.5 * fit.chi2
        likely = np.flatnonzero(likelihood > likelihood.max() - _NEGLIGIBLE)
        step = turns[1] - turns[0]
        widest = turns[likely[0]] - step, turns[likely[-1]] + step
        turns = np.linspace(*widest, _STEPS)
    weight = np.exp(likelihood - likelihood.max())
    weight /= weight.sum()
    return _mean_pose(fit.position_mm, fit.rotation, fit.covariance, weight)


def _mean_pose(P: Float, R: Float, S: Float, weight: Float) -> Pose:
    best = R[int(weight.argmax())]
    vectors = vector_from_rotation(R @ best.T)
    mean = weight @ vectors
    rotation = rotation_from_vector(mean) @ best
    away = np.concatenate([P - weight @ P, np.degrees(vectors - mean)], axis=1)
    spread = (weight[:, None, None] * (S + away[:, :, None] * away[:, None, :])).sum(axis=0)
    return Pose(weight @ P, rotation, spread)


def _repeated(view: TriadImages, count: int) -> TriadImages:
    return TriadImages(
        view.pinhole,
        np.repeat(view.ideal_mm, count, axis=0),
        np.repeat(view.weight, count, axis=0),
        view.common_sd_mm,
    )
