"""The maximum-likelihood pose of a triad: six parameters fitted to the ball images of all cameras at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Bool, Float, Int
from spinewatch.detection.features import HIDDEN
from spinewatch.geometry.projection import Pinhole, PinholeStack
from spinewatch.geometry.rays import Rays
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.geometry.small_matrices import inverse_2x2
from spinewatch.triads.pose import Pose

_TOLERANCE = 1e-9
"""The adjustment ends with steps smaller than this, mm and radians."""

_HELD_WEIGHT = 1e12
"""Weight of a rotation that is held, per rad^2."""

_MIN_CONDITION = 1e-9
"""Smallest reciprocal condition of determined normal equations, in mm and radians times the size of the marker."""


@dataclass(frozen=True)
class PoseAdjustmentParameters:
    """Parameters of the Gauss-Newton adjustment.

    Attributes
    ----------
    max_steps
        Largest number of steps.
    max_rotation_step_mrad
        Largest rotation in one step, mrad; longer steps are shortened.
    """

    max_steps: int = 30
    max_rotation_step_mrad: float = 500.0


@dataclass(frozen=True, eq=False)
class TriadImages:
    """The images of t triads of n balls in one camera.

    Attributes
    ----------
    pinhole
        The camera's central projection.
    ideal_mm
        Undistorted offsets of the ball images from the principal point, shape (t, n, 2), mm.
    weight
        Their inverse covariances, shape (t, n, 2, 2), per mm^2; zero for a hidden ball.
    common_sd_mm
        Standard deviation per axis of an error that the ball images of a triad share, on the image plane, mm.
    """

    pinhole: Pinhole
    ideal_mm: Float
    weight: Float
    common_sd_mm: float = 0.0

    @property
    def visible(self) -> Bool:
        """Whether the image shows each ball, shape (t, n)."""
        return np.asarray(self.weight[..., 0, 0] > 0)

    def repeat(self, triad: int, count: int) -> TriadImages:
        """Return the images of one triad several times.

        Parameters
        ----------
        triad
            Index of the triad.
        count
            Number of repetitions.

        Returns
        -------
        TriadImages
            ``count`` times the same images.
        """
        return TriadImages(
            self.pinhole,
            np.repeat(self.ideal_mm[triad : triad + 1], count, axis=0),
            np.repeat(self.weight[triad : triad + 1], count, axis=0),
            self.common_sd_mm,
        )


@dataclass(frozen=True, eq=False)
class PoseAdjustment:
    """t adjusted poses.

    Attributes
    ----------
    position_mm
        Positions of P, shape (t, 3), object space, mm.
    rotation
        Rotations from marker to object axes, shape (t, 3, 3).
    covariance
        Covariances as in `Pose`, shape (t, 6, 6); NaN where the pose is not determined.
    chi2
        Chi-squares of the image residuals, shape (t,).
    dof
        Their degrees of freedom, shape (t,).
    determined
        Whether the images determine all six parameters, shape (t,).
    """

    position_mm: Float
    rotation: Float
    covariance: Float
    chi2: Float
    dof: Int
    determined: Bool

    def pose(self, index: int) -> Pose:
        """Return one of the poses.

        Parameters
        ----------
        index
            Index of the triad.

        Returns
        -------
        Pose
            Its pose.
        """
        return Pose(self.position_mm[index], self.rotation[index], self.covariance[index])


def triad_images(rays: Rays, index: Int, common_sd_mrad: float = 0.0) -> TriadImages:
    """Return the images of triads whose balls are given rays of one camera.

    Parameters
    ----------
    rays
        Rays of the features of an image.
    index
        Indices of the rays of t triads of n balls, shape (t, n); `HIDDEN` for a ball that is not visible.
    common_sd_mrad
        Standard deviation per axis of an error that the ball images of a triad share, mrad.

    Returns
    -------
    TriadImages
        The images of t triads.
    """
    visible = index != HIDDEN
    safe = np.where(visible, index, 0)
    weight = inverse_2x2(rays.covariance_mm2)[safe] * visible[..., None, None]
    common = rays.pinhole.focal_length_mm * common_sd_mrad / 1000
    return TriadImages(rays.pinhole, rays.ideal_mm[safe], weight, common)


def adjust_poses(
    model_mm: Float,
    images: Sequence[TriadImages],
    position_mm: Float,
    rotation: Float,
    parameters: PoseAdjustmentParameters | None = None,
    held_axis: Float | None = None,
) -> PoseAdjustment:
    """Return the poses of triads with the least weighted image residuals.

    Gauss-Newton on the collinearity equations, with residuals on the undistorted image plane. The known distances of
    the marker constrain the ranges of its balls: rotation errors are 0.8 times those of absolute orientation on
    triangulated balls (``python -m bench.matching``). The error that the balls of a triad share in an image is one more
    pair of unknowns per image, eliminated from the normal equations: it increases the variance of positions and hardly
    that of rotations.

    Parameters
    ----------
    model_mm
        Balls of the marker, shape (n, 3), or of the marker of each triad, shape (t, n, 3), marker frame, mm.
    images
        Images of the t triads in each camera.
    position_mm, rotation
        Initial values, shapes (t, 3), mm, and (t, 3, 3): `approximate_poses` of the triangulated balls, or the pose of
        occluded candidates.
    parameters
        Parameters of the adjustment; the default ones if None.
    held_axis
        Unit vectors in object space about which the poses are not rotated, shape (t, 3).

    Returns
    -------
    PoseAdjustment
        The adjusted poses.

    References
    ----------
    Thesis eq. 3.4 for each ball. The thesis derives P and the normal from triangulated balls instead (fig. 5.7).

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.markers import FLAT_10_14_18 as model
    >>> from spinewatch.simulation.rigs import large_rig
    >>> balls, weight = model.coordinates_mm + [430.0, 390.0, 90.0], np.full((1, 3, 2, 2), 1e4 * np.eye(2))
    >>> cameras = [camera.pinhole for camera in (large_rig().left, large_rig().right)]
    >>> images = [TriadImages(pinhole, pinhole.project(balls)[0][None], weight) for pinhole in cameras]
    >>> found = adjust_poses(model.coordinates_mm, images, np.array([[425.0, 393, 85]]), np.eye(3)[None])
    >>> found.position_mm.round(6), found.dof
    (array([[430., 390.,  90.]]), array([6]))
    """
    p = parameters or PoseAdjustmentParameters()
    P, R = position_mm, rotation
    cameras, weight = PinholeStack.of([image.pinhole for image in images]), _weights(images)
    observed = np.array([image.ideal_mm for image in images])
    held = np.zeros((len(P), 6, 6))
    if held_axis is not None:
        held[:, 3:, 3:] = _HELD_WEIGHT * held_axis[:, :, None] * held_axis[:, None, :]
    for _ in range(p.max_steps):
        N, b, chi2 = _normal_equations(model_mm, cameras, observed, weight, P, R)
        N += held
        step = np.asarray(np.linalg.solve(_damped(N), b[..., None])[..., 0], dtype=np.float64)
        angle = np.sqrt((step[:, 3:] ** 2).sum(axis=1, keepdims=True))
        step = step / np.maximum(angle / (p.max_rotation_step_mrad / 1000), 1.0)
        P, R = P + step[:, :3], rotation_from_vector(step[:, 3:]) @ R
        if not np.any(np.abs(step) > _TOLERANCE):
            break
    else:
        N, _, chi2 = _normal_equations(model_mm, cameras, observed, weight, P, R)
        N += held
    covariance, determined = _covariance(N, float(np.linalg.norm(model_mm, axis=-1).max()))
    dof = 2 * sum((image.visible.sum(axis=1) for image in images), np.zeros(len(P), dtype=np.intp)) - 6
    return PoseAdjustment(P, R, covariance, chi2, np.asarray(dof, dtype=np.intp), determined)


def _covariance(N: Float, size_mm: float) -> tuple[Float, Bool]:
    """Return covariances (t, 6, 6) in mm and degrees, NaN where not determined, and whether they are (t,)."""
    scale = np.repeat(
        [1.0, 1 / size_mm], 3
    )  # a rotation moves balls by its angle times the size of the marker
    values = np.linalg.eigvalsh(N * np.outer(scale, scale))
    determined = values[:, 0] > _MIN_CONDITION * values[:, -1]
    unit = np.repeat([1.0, np.degrees(1.0)], 3)
    S = np.full(N.shape, np.nan)
    S[determined] = np.linalg.inv(N[determined]) * np.outer(unit, unit)
    return S, np.asarray(determined)


def _damped(N: Float) -> Float:
    """Return normal equations (t, 6, 6) with a slight damping, so that undetermined motions are not changed."""
    damping = 1e-12 * np.trace(N, axis1=1, axis2=2)[:, None, None]
    return np.asarray(N + damping * np.eye(6))


def _weights(images: Sequence[TriadImages]) -> Float:
    """Return the inverse covariances (k, t, 2 n, 2 n) of the ball images of triads in k cameras."""
    own = np.array([image.weight for image in images])
    variance = np.array([image.common_sd_mm for image in images])[:, None, None, None] ** 2
    shared = variance * inverse_2x2(np.eye(2) + variance * own.sum(axis=2))
    k, t, n = own.shape[:3]
    columns = np.swapaxes(own, 2, 3).reshape(k, t, 2, 2 * n)
    weight = -np.swapaxes(columns, 2, 3) @ shared @ columns
    ball = np.arange(n)
    weight.reshape(k, t, n, 2, n, 2)[:, :, ball, :, ball] += own.transpose(2, 0, 1, 3, 4)
    return np.asarray(weight)


def _normal_equations(
    model_mm: Float, cameras: PinholeStack, observed_mm: Float, weight: Float, P: Float, R: Float
) -> tuple[Float, Float, Float]:
    """Return N (t, 6, 6), b (t, 6) and chi2 (t,) of the linearized residuals; rotations are about object axes."""
    k, t, n = observed_mm.shape[:3]
    arms = model_mm @ np.swapaxes(R, -1, -2)
    a = np.ascontiguousarray(arms.reshape(-1, 3).T)
    predicted, J = cameras.project((P[:, None, :] + arms).reshape(-1, 3).T)
    turned = a[[1, 2, 0]] * J[:, :, [2, 0, 1]] - a[[2, 0, 1]] * J[:, :, [1, 2, 0]]
    residual = observed_mm.reshape(k, t * n, 2).swapaxes(1, 2) - predicted
    linear = np.concatenate([J, turned, residual[:, :, None]], axis=2).reshape(k, 2, 7, t, n)
    linear = linear.transpose(0, 3, 4, 1, 2).reshape(k, t, 2 * n, 7)
    N = (np.swapaxes(linear, -1, -2) @ (weight @ linear)).sum(axis=0)
    return N[:, :6, :6], N[:, :6, 6], N[:, 6, 6]
