"""Check of the rig: whether ball images still satisfy the calibration.

If a camera has moved, the right image of a ball is no longer on the epipolar line of the left one. Only the distance
from that line is observable: rotations and shifts that move images along the lines are equivalent to other depths,
above all a rotation about the vertical of the image and a shift along the base. Their estimates keep the standard
deviation of the prior. They change the scale of the markers (`spinewatch.matching.marker_scale`), which is tested too.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.special import chdtrc

from spinewatch.arrays import Float, Int
from spinewatch.camera import Camera, Rig
from spinewatch.detection.features import Features
from spinewatch.geometry.rays import Rays
from spinewatch.geometry.rotations import cross_matrix
from spinewatch.matching.marker_scale import MarkerScale, MarkerScaleParameters
from spinewatch.matching.scale_measurement import MarkerBalls, measure_scale

_RANK_TOLERANCE = 1e-6
"""Directions with less than this fraction of the largest information are not determined."""

_RELATIVE_ORIENTATION_DOF = 5
"""Parameters of a relative orientation, which the residuals determine at most."""

_OTHER_CAUSE = "movement between exposures that were not taken together looks the same"
"""What else than a moved camera displaces images across the epipolar lines."""


@dataclass(frozen=True)
class RigCheckParameters:
    """Limits and prior knowledge of a drift of the rig.

    Attributes
    ----------
    tolerance_mrad
        Standard deviation of the relative direction of the cameras without drift, mrad: errors of the calibration.
    common_sd_mrad
        Standard deviation per axis of the pointing error that the balls of a marker share in an image, mrad.
    max_p_value
        P-value below which a rig is flagged as drifted: probability to flag one that has not.
    bump_sd_deg
        Prior standard deviation per axis of the rotation of a camera that was bumped, degrees.
    bump_sd_mm
        Prior standard deviation per axis of its shift, mm.
    covariance_dof
        Weight of the stated covariances of the features against the observed residuals, in degrees of freedom.
    min_information
        Smallest information of the residuals about a direction of motion, relative to the prior, with which the
        direction is tested.
    min_balls
        Smallest number of balls for a check.
    refine
        Whether the search is repeated with the relative orientation corrected when the rig has drifted across the
        epipolar lines.
    marker_scale
        Check of the scale of the markers.
    """

    tolerance_mrad: float = 0.08
    common_sd_mrad: float = 0.12
    max_p_value: float = 1e-3
    bump_sd_deg: float = 0.1
    bump_sd_mm: float = 0.5
    covariance_dof: int = 20
    min_information: float = 1.0
    min_balls: int = 6
    refine: bool = False
    marker_scale: MarkerScaleParameters = field(default_factory=MarkerScaleParameters)


@dataclass(frozen=True, eq=False)
class RigCheck:
    """Result of the check.

    Attributes
    ----------
    balls
        Number of balls that both images show.
    rms_px
        RMS distance from the epipolar lines in the right image, px.
    chi2
        Chi-square of the part of the residuals that a moved camera explains.
    dof
        Its degrees of freedom.
    p_value
        Probability of this or a larger chi-square without drift.
    off_epipolar
        Whether the p-value is below the limit.
    rotation_deg
        Estimated rotation vector of the right camera relative to the left one, shape (3,), axes of the right camera,
        degrees.
    rotation_sd_deg
        Its standard deviations, shape (3,), degrees.
    shift_mm
        Estimated shift of the right camera, shape (3,), its own axes, mm.
    shift_sd_mm
        Its standard deviations, shape (3,), mm.
    marker_scale
        Scale of the markers; None for too few known distances.
    """

    balls: int
    rms_px: float
    chi2: float
    dof: int
    p_value: float
    off_epipolar: bool
    rotation_deg: Float
    rotation_sd_deg: Float
    shift_mm: Float
    shift_sd_mm: Float
    marker_scale: MarkerScale | None = None

    @property
    def drifted(self) -> bool:
        """Whether the balls are off their epipolar lines or the markers are not measured in their size."""
        return self.off_epipolar or (self.marker_scale is not None and self.marker_scale.drifted)

    @property
    def message(self) -> str:
        """Description of a drift, with its estimate."""
        scale = (
            self.marker_scale.message if self.marker_scale is not None and self.marker_scale.drifted else None
        )
        parts = [self._epipolar_message] if self.off_epipolar or scale is None else []
        return "; ".join([*parts, *([scale] if scale else []), _OTHER_CAUSE, "calibrate again"])

    @property
    def _epipolar_message(self) -> str:
        """Description of a drift across the epipolar lines."""
        rotation, shift = (
            ", ".join(f"{value:.{digits}f} ± {sd:.{digits}f}" for value, sd in zip(values, sds, strict=True))
            for values, sds, digits in (
                (self.rotation_deg, self.rotation_sd_deg, 3),
                (self.shift_mm, self.shift_sd_mm, 2),
            )
        )
        return (
            f"the images of {self.balls} balls are {self.rms_px:.2f} px (RMS) off their epipolar lines; a camera has"
            f" moved: if it was the right one, by about ({rotation}) degrees and ({shift}) mm"
        )


def check_rig(
    rig: Rig,
    left: Features,
    right: Features,
    parameters: RigCheckParameters | None = None,
    markers: MarkerBalls | None = None,
) -> RigCheck | None:
    """Return whether ball images satisfy the calibration of the rig.

    The residuals, whitened by the covariances of the features, are explained by a motion of the right camera with a
    normal prior. Those that no motion explains scale all deviations, so that large errors of the features are not
    mistaken for a drift. Balls of several stages may be combined, which detects smaller drifts.

    Parameters
    ----------
    rig
        The calibrated cameras.
    left, right
        Images of the balls: the i-th features belong to the same ball.
    parameters
        Limits and prior knowledge; the default ones if None.
    markers
        Markers of the balls; None if they are not known: then every ball has its own pointing error, and the scale is
        not checked.

    Returns
    -------
    RigCheck or None
        The result; None for fewer balls than `min_balls`.

    References
    ----------
    Coplanarity condition: T. Luhmann et al., Close-Range Photogrammetry and 3D Imaging, section 4.3. Not in the thesis.

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.simulation.rigs import large_rig
    >>> rig, rng = large_rig(), np.random.default_rng(0)
    >>> balls = rng.uniform((380, 350, 70), (490, 430, 110), (12, 3))
    >>> left, right = (
    ...     Features.with_sigma(camera.project(balls), np.ones(12), 0.1) for camera in (rig.left, rig.right)
    ... )
    >>> check_rig(rig, left, right).drifted
    False
    """
    p = parameters or RigCheckParameters()
    if len(left) < p.min_balls:
        return None
    rays = left.rays(rig.left), right.rays(rig.right)
    marker = np.arange(len(left)) if markers is None else markers.marker
    error, J, px = _coplanarity(rig.left, rig.right, *rays)
    whitening = np.linalg.inv(
        np.linalg.cholesky(_covariance(rig.left, rig.right, *rays, marker, p.common_sd_mrad))
    )
    unit = np.repeat([np.radians(p.bump_sd_deg), p.bump_sd_mm], 3)
    residual, J = whitening @ error, whitening @ J * unit
    N, b = J.T @ J, -J.T @ residual
    information, directions = np.linalg.eigh(N)
    along = directions.T @ b
    known = information > _RANK_TOLERANCE * information[-1]
    explained = (along[known] ** 2 / information[known]).sum()
    unexplained = float(p.covariance_dof + residual @ residual - explained)
    unexplained_dof = p.covariance_dof + len(residual) - _RELATIVE_ORIENTATION_DOF
    variance_factor = unexplained / unexplained_dof
    information, along = information / variance_factor, along / variance_factor
    tested = known & (information > p.min_information)
    variance = information + (p.tolerance_mrad / 1000 / unit[0] * information) ** 2
    chi_square, dof = float((along[tested] ** 2 / variance[tested]).sum()), int(tested.sum())
    S = np.linalg.inv(N / variance_factor + np.eye(6))
    motion, motion_sd = S @ b / variance_factor * unit, np.sqrt(np.diag(S)) * unit
    p_value = float(chdtrc(dof, chi_square)) if dof else 1.0
    scale = None
    if markers is not None:
        spread = (unexplained, unexplained_dof)
        scale = measure_scale(rig, rays, markers, p.marker_scale, spread)
    return RigCheck(
        balls=len(left),
        rms_px=float(np.sqrt(np.mean(px**2))),
        chi2=chi_square,
        dof=dof,
        p_value=p_value,
        off_epipolar=p_value < p.max_p_value,
        rotation_deg=np.degrees(motion[:3]),
        rotation_sd_deg=np.degrees(motion_sd[:3]),
        shift_mm=motion[3:],
        shift_sd_mm=motion_sd[3:],
        marker_scale=scale,
    )


def refined_rig(rig: Rig, check: RigCheck) -> Rig:
    """Return the rig with the estimated motion applied to its right camera.

    Parameters
    ----------
    rig
        The calibrated cameras.
    check
        Result of their check.

    Returns
    -------
    Rig
        A rig with corrected relative orientation; object space stays that of the left camera.
    """
    return Rig(
        f"{rig.name} (refined)",
        rig.left,
        rig.right.moved(np.radians(check.rotation_deg), check.shift_mm),
    )


def _coplanarity(
    left: Camera, right: Camera, rays_left: Rays, rays_right: Rays
) -> tuple[Float, Float, Float]:
    """Return coplanarity errors ``(B x a_L) . a_R``, shape (n,), and the same as pixels in the right image.

    Between them, their derivatives (n, 6) with respect to a rotation and a shift of the right camera in its own axes.
    """
    normal = rays_left.vectors @ cross_matrix(right.centre - left.centre).T
    error = (normal * rays_right.vectors).sum(axis=1)
    turned, shifted = np.cross([normal, rays_left.vectors], rays_right.vectors) @ right.M.T
    px = error / np.linalg.norm(normal @ right.M[:2].T, axis=1) / right.pixel_size_mm[1]
    return error, np.concatenate([turned, shifted], axis=1), px


def _covariance(
    left: Camera, right: Camera, rays_left: Rays, rays_right: Rays, marker: Int, common_sd_mrad: float
) -> Float:
    """Return the covariance (n, n) of coplanarity errors: own errors, and those that a marker shares per image."""
    across = cross_matrix(right.centre - left.centre)
    same = marker[:, None] == marker
    S = np.zeros(same.shape)
    for camera, rays, normal in (
        (right, rays_right, rays_left.vectors @ across.T),
        (left, rays_left, rays_right.vectors @ across),
    ):
        gradient = normal @ camera.M[:2].T
        S += np.diag(np.einsum("ni,nij,nj->n", gradient, rays.covariance_mm2, gradient))
        S += same * (gradient @ gradient.T) * (common_sd_mrad / 1000 * camera.focal_length_mm) ** 2
    return S
