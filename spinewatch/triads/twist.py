"""The mean pose over a rotation that the images hardly determine.

If both images show two balls of a triad, it can still rotate about the line through them; this rotation is called twist
here. A single image of the third ball determines the twist poorly, since that ball moves mainly along its line of
sight: two twists may fit, or a range of them. The curvature of the likelihood at its maximum would understate the
variance. The twist is therefore sampled, the other five parameters are adjusted at each sample, and position, rotation
and covariance are the moments of the resulting distribution.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import rotation_from_vector, vector_from_rotation
from spinewatch.triads.pose import Pose
from spinewatch.triads.pose_adjustment import (
    PoseAdjustment,
    PoseAdjustmentParameters,
    TriadImages,
    adjust_poses,
)


def _few_steps() -> PoseAdjustmentParameters:
    return PoseAdjustmentParameters(max_steps=4)


@dataclass(frozen=True)
class TwistParameters:
    """How the twist is sampled.

    Attributes
    ----------
    max_angle_deg
        Largest twist from the initial pose, in both directions, degrees.
    n_samples
        Number of samples over all twists, and again over the likely ones.
    max_log_ratio
        Twists whose log-likelihood is further than this below the largest one are not likely.
    adjustment
        Adjustment of the other five parameters.
    """

    max_angle_deg: float = 80.0
    n_samples: int = 73
    max_log_ratio: float = 20.0
    adjustment: PoseAdjustmentParameters = field(default_factory=_few_steps)


@dataclass(frozen=True, eq=False)
class TiltPrior:
    """Prior distribution of the tilt of a marker.

    Attributes
    ----------
    towards
        Expected direction of the marker's z, shape (3,), object space, of any length.
    sd_deg
        Standard deviation of the tilt per axis, degrees.
    """

    towards: Float
    sd_deg: float

    def log_density(self, rotation: Float) -> Float:
        """Return the log density of rotations, without its constant.

        Parameters
        ----------
        rotation
            Rotations from marker to object axes, shape (n, 3, 3).

        Returns
        -------
        Float
            Log densities, shape (n,).
        """
        cosine = rotation[:, :, 2] @ (self.towards / np.linalg.norm(self.towards))
        angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
        return np.asarray(-0.5 * (angle / self.sd_deg) ** 2)


def average_over_twist(
    model_mm: Float,
    images: Sequence[TriadImages],
    initial: Pose,
    axis_balls: tuple[int, int],
    tilt: TiltPrior,
    parameters: TwistParameters,
) -> Pose:
    """Return the mean pose of a triad over all twists about the line through two balls.

    Parameters
    ----------
    model_mm
        Balls of the marker, shape (n, 3), marker frame, mm.
    images
        Images of the one triad in each camera.
    initial
        A pose that fits the images.
    axis_balls
        Indices of the two balls.
    tilt
        Prior distribution of the tilt.
    parameters
        How the twist is sampled.

    Returns
    -------
    Pose
        Mean pose and covariance, weighted by likelihood and prior.

    References
    ----------
    Not in the thesis, which needs all balls in both images.
    """
    angles = np.radians(
        np.linspace(-parameters.max_angle_deg, parameters.max_angle_deg, parameters.n_samples)
    )
    fit, log_likelihood = _profile(model_mm, images, initial, axis_balls, tilt, parameters, angles)
    likely = np.flatnonzero(log_likelihood > log_likelihood.max() - parameters.max_log_ratio)
    step = angles[1] - angles[0]
    angles = np.linspace(angles[likely[0]] - step, angles[likely[-1]] + step, parameters.n_samples)
    fit, log_likelihood = _profile(model_mm, images, initial, axis_balls, tilt, parameters, angles)
    weight = np.exp(log_likelihood - log_likelihood.max())
    weight /= weight.sum()
    return mean_pose(fit.position_mm, fit.rotation, fit.covariance, weight)


def mean_pose(position_mm: Float, rotation: Float, covariance: Float, weight: Float) -> Pose:
    """Return the first two moments of a mixture of poses.

    Parameters
    ----------
    position_mm
        Positions, shape (n, 3), mm.
    rotation
        Rotations, shape (n, 3, 3).
    covariance
        Covariances as in `Pose`, shape (n, 6, 6).
    weight
        Weights of sum 1, shape (n,).

    Returns
    -------
    Pose
        Weighted mean; its covariance is the mean covariance plus the scatter of the poses.

    Examples
    --------
    >>> import numpy as np
    >>> positions = np.array([[0.0, 0, 0], [2.0, 0, 0]])
    >>> pose = mean_pose(positions, np.stack([np.eye(3)] * 2), np.zeros((2, 6, 6)), np.array([0.5, 0.5]))
    >>> pose.position_mm, pose.position_sd_mm
    (array([1., 0., 0.]), array([1., 0., 0.]))
    """
    best = rotation[int(weight.argmax())]
    vectors = vector_from_rotation(rotation @ best.T)
    mean = weight @ vectors
    mean_rotation = rotation_from_vector(mean) @ best
    deviation = np.concatenate([position_mm - weight @ position_mm, np.degrees(vectors - mean)], axis=1)
    scatter = deviation[:, :, None] * deviation[:, None, :]
    S = (weight[:, None, None] * (covariance + scatter)).sum(axis=0)
    return Pose(weight @ position_mm, mean_rotation, S)


def _profile(
    model_mm: Float,
    images: Sequence[TriadImages],
    initial: Pose,
    axis_balls: tuple[int, int],
    tilt: TiltPrior,
    parameters: TwistParameters,
    angles_rad: Float,
) -> tuple[PoseAdjustment, Float]:
    """Return the best pose for each twist (n,) and its log-likelihood (n,): the profile likelihood."""
    a, b = axis_balls
    axis = initial.rotation @ (model_mm[b] - model_mm[a])
    axis /= np.linalg.norm(axis)
    pivot = initial.position_mm + initial.rotation @ model_mm[a]
    R = rotation_from_vector(angles_rad[:, None] * axis)
    P = pivot + (R @ (initial.position_mm - pivot))
    n = len(angles_rad)
    fit = adjust_poses(
        model_mm,
        [image.repeat(0, n) for image in images],
        P,
        R @ initial.rotation,
        parameters.adjustment,
        np.tile(axis, (n, 1)),
    )
    return fit, tilt.log_density(fit.rotation) - 0.5 * fit.chi2
