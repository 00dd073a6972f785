"""The seven-parameter fit of radiographs to object space by common points, with its tests; NumPy only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import erfc, exp, lgamma, log, sqrt
from statistics import NormalDist

import numpy as np

from spinewatch.arrays import Float
from spinewatch.errors import SpinewatchError
from spinewatch.flags import Flag
from spinewatch.geometry.covariance import covariance_factor
from spinewatch.geometry.rotations import cross_matrix
from spinewatch.geometry.transforms import DegeneratePointsError, SimilarityTransform, fit_similarity

_PARAMETERS = 7


class CommonPointsError(SpinewatchError):
    """The common points do not determine a seven-parameter transform."""

    code = "common-points-undetermined"


class RadiographScaleError(SpinewatchError):
    """The scale between radiographs and object space is not that of true millimetres."""

    code = "radiograph-scale-implausible"


@dataclass(frozen=True)
class RadiographFitParameters:
    """Limits of the seven-parameter fit.

    Attributes
    ----------
    flagged_scale
        Difference of the scale from 1 from which it is flagged.
    refused_scale
        Difference from 1 above which the fit is refused.
    significance
        Probability of the tests of the scale, the residuals and the heights for sound input.
    max_rotation_sd_deg
        Largest standard deviation of the rotation about any axis of a transform that counts as determined, degrees.
    """

    flagged_scale: float = 0.02
    refused_scale: float = 0.05
    significance: float = 0.001
    max_rotation_sd_deg: float = 10.0


@dataclass(frozen=True)
class PointResidual:
    """How a common point fits.

    Attributes
    ----------
    name
        Name of the point.
    residual_mm
        Its place in object space minus its place by the transform, shape (3,), mm.
    distance_mm
        Length of that, mm.
    chi2
        The square of it weighted by its covariance: chi-squared with ``dof`` degrees of freedom for a sound point.
    dof
        Its degrees of freedom.
    blunder
        Whether it is the point that fits worst, and significantly.
    """

    name: str
    residual_mm: Float
    distance_mm: float
    chi2: float
    dof: int
    blunder: bool


@dataclass(frozen=True, eq=False)
class SimilarityFit:
    """A similarity transform fitted to points whose errors are known.

    Attributes
    ----------
    transform
        The transform from radiograph to object axes.
    centre_mm
        Centroid of the fitted points in object space, shape (3,), mm.
    covariance
        Covariance of translation at the centroid (mm), small rotation about the object axes (radians) and relative
        scale, shape (7, 7).
    residuals
        Residual of each point.
    rms_mm
        Root mean square of their lengths, mm.
    chi2
        Squared residuals weighted by their covariance.
    dof
        Degrees of freedom of that.
    """

    transform: SimilarityTransform
    centre_mm: Float
    covariance: Float
    residuals: tuple[PointResidual, ...]
    rms_mm: float
    chi2: float
    dof: int

    @property
    def scale_sd(self) -> float:
        """Standard deviation of the scale."""
        return self.transform.scale * float(np.sqrt(self.covariance[6, 6]))

    @property
    def rotation_sd_deg(self) -> Float:
        """Standard deviations of the rotation about the object axes, shape (3,), degrees."""
        return np.degrees(np.sqrt(np.diag(self.covariance)[3:6]))

    @property
    def translation_sd_mm(self) -> Float:
        """Standard deviations of the translation at the centroid of the points, shape (3,), mm."""
        return np.sqrt(np.diag(self.covariance)[:3])

    def pose_factor(self, points_mm: Float) -> Float:
        """Return what the errors of the transform do to poses that it transforms.

        Parameters
        ----------
        points_mm
            Transformed positions, shape (n, 3), object space, mm.

        Returns
        -------
        Float
            Error factor, shape (n, 6, 7): columns are independent and common to all poses, rows as of
            `Pose.covariance`.
        """
        J = np.zeros((len(points_mm), 6, _PARAMETERS))
        J[:, :3] = _design(points_mm - self.centre_mm)
        J[:, 3:, 3:6] = np.degrees(np.eye(3))
        return np.asarray(J @ covariance_factor(self.covariance))


def fit_common_points(
    names: Sequence[str],
    source_mm: Float,
    source_variances_mm2: Float,
    target_mm: Float,
    target_covariances_mm2: Float,
    parameters: RadiographFitParameters | None = None,
) -> SimilarityFit:
    """Return the similarity from radiograph to object space and how well it is determined.

    Least squares without weights; its covariance and that of its residuals follow from those of both sets of points
    to first order. A residual with the covariance C of its own is tested by ``r^T C^-1 r``, which is the same
    for the distance of the point from a fit without it.

    Parameters
    ----------
    names
        Names of the points.
    source_mm
        Points in the axes of the radiographs, shape (n, 3), mm.
    source_variances_mm2
        Variances of each of them along these axes, shape (3,), mm^2.
    target_mm
        The points in object space, shape (n, 3), mm.
    target_covariances_mm2
        Their covariances, shape (n, 3, 3), mm^2.
    parameters
        Limits, by default `RadiographFitParameters`.

    Returns
    -------
    SimilarityFit
        Transform, covariance and residuals.

    Raises
    ------
    CommonPointsError
        If there are less than three points, or they lie on one line or together to within their errors.

    References
    ----------
    S. Umeyama, IEEE PAMI 13 (1991) 376, for the transform; W. Baarda, A testing procedure for use in geodetic networks
    (1968), for the test of single points.
    """
    p = parameters or RadiographFitParameters()
    n = len(names)
    if n < 3:
        raise CommonPointsError(
            f"{n} common points do not determine a transform; give at least three, not on one line"
        )
    try:
        transform = fit_similarity(source_mm, target_mm)
    except DegeneratePointsError as error:
        raise CommonPointsError(_UNDETERMINED) from error
    if not transform.scale > 0:
        raise CommonPointsError(_UNDETERMINED)
    centre = target_mm.mean(axis=0)
    sR = transform.scale * transform.rotation
    A = _design((source_mm - source_mm.mean(axis=0)) @ sR.T).reshape(3 * n, _PARAMETERS)
    N = A.T @ A
    # Lengths in mm beside radians: judged in units of the points' extent.
    scaled = N / np.sqrt(np.outer(np.diag(N), np.diag(N)))
    if np.linalg.cond(scaled) > _MAX_CONDITION:
        raise CommonPointsError(_UNDETERMINED)
    S = _block_diagonal(target_covariances_mm2 + (sR * source_variances_mm2) @ sR.T)
    G = np.linalg.solve(N, A.T)
    covariance = G @ S @ G.T
    worst_sd = float(np.degrees(np.sqrt(np.linalg.eigvalsh(covariance[3:6, 3:6])[-1])))
    if worst_sd > p.max_rotation_sd_deg:
        raise CommonPointsError(
            f"{_UNDETERMINED} (the rotation would have a deviation of {worst_sd:.0f} degrees)"
        )
    r = target_mm - transform(source_mm)
    remaining = np.eye(3 * n) - A @ G
    C = remaining @ S @ remaining.T
    dof = 3 * n - _PARAMETERS
    own = [C[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] for i in range(n)]
    own_dof = min(3, dof)
    chi2 = np.array([_weighted_square(r[i], own[i], own_dof) for i in range(n)])
    worst = int(np.argmax(chi2))
    doubtful = n > 3 and chi2_p_value(chi2[worst], own_dof) < p.significance / n
    lengths = np.linalg.norm(r, axis=1)
    return SimilarityFit(
        transform=transform,
        centre_mm=centre,
        covariance=covariance,
        residuals=tuple(
            PointResidual(name, r[i], float(lengths[i]), float(chi2[i]), own_dof, doubtful and i == worst)
            for i, name in enumerate(names)
        ),
        rms_mm=float(np.sqrt(np.mean(lengths**2))),
        chi2=_weighted_square(r.ravel(), C, dof),
        dof=dof,
    )


def fit_flags(fit: SimilarityFit, parameters: RadiographFitParameters | None = None) -> tuple[Flag, ...]:
    """Return what is doubtful of a fit, or refuse it.

    Parameters
    ----------
    fit
        The fit.
    parameters
        Limits, by default `RadiographFitParameters`.

    Returns
    -------
    tuple of Flag
        ``radiograph-point-doubtful``, ``radiograph-points-disagree`` and ``radiograph-scale``.

    Raises
    ------
    RadiographScaleError
        If the scale differs from 1 by more than ``refused_scale``.
    """
    p = parameters or RadiographFitParameters()
    flags: list[Flag] = []
    doubtful = next((point for point in fit.residuals if point.blunder), None)
    if doubtful is not None:
        flags.append(
            Flag(
                "radiograph-point-doubtful",
                f"common point {doubtful.name} is {doubtful.distance_mm:.1f} mm from where the others place it"
                f" (chi-squared {doubtful.chi2:.0f} of {doubtful.dof}; RMS of all {fit.rms_mm:.1f} mm)",
            )
        )
    elif disagreement(fit, p) > 1:
        flags.append(
            Flag(
                "radiograph-points-disagree",
                f"the common points fit with an RMS of {fit.rms_mm:.1f} mm, chi-squared {fit.chi2:.0f} of {fit.dof};"
                " deviations are enlarged by the root of the ratio",
            )
        )
    scale = fit.transform.scale
    shown = f"the scale from the radiographs to object space is {scale:.4f}, standard deviation {fit.scale_sd:.4f}"
    if abs(scale - 1) > p.refused_scale:
        point = f"; {doubtful.name} fits worst of the common points" if doubtful is not None else ""
        raise RadiographScaleError(
            f"{shown}, more than {p.refused_scale:.0%} from 1{point}; give the pixel spacing at the patient, not at the"
            " detector, or correct the common points"
        )
    significant = abs(scale - 1) > NormalDist().inv_cdf(1 - p.significance / 2) * fit.scale_sd
    if significant or abs(scale - 1) >= p.flagged_scale:
        flags.append(Flag("radiograph-scale", f"{shown}"))
    return tuple(flags)


def disagreement(fit: SimilarityFit, parameters: RadiographFitParameters | None = None) -> float:
    """Return the factor by which residuals are larger than the stated errors explain.

    Parameters
    ----------
    fit
        The fit.
    parameters
        Limits, by default `RadiographFitParameters`.

    Returns
    -------
    float
        Root of chi-squared over its degrees of freedom if significantly above 1, otherwise 1.
    """
    p = parameters or RadiographFitParameters()
    if chi2_p_value(fit.chi2, fit.dof) >= p.significance:
        return 1.0
    return float(np.sqrt(fit.chi2 / fit.dof))


def chi2_p_value(value: float, dof: int) -> float:
    """Return the probability that chi-squared is as large as a value or larger.

    Parameters
    ----------
    value
        The value, not negative.
    dof
        Degrees of freedom, at least 1.

    Returns
    -------
    float
        The probability.

    References
    ----------
    M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions (1964), 26.4.4 and 26.4.5. SciPy has it too, but the
    service, which shows fits, does without SciPy.

    Examples
    --------
    >>> round(chi2_p_value(16.266, 3), 5)
    0.001
    """
    half = value / 2
    if half == 0:
        return 1.0
    first = 2 - dof % 2
    total = exp(-half) if first == 2 else erfc(sqrt(half))
    for k in range(first, dof, 2):
        total += exp(k / 2 * log(half) - half - lgamma(k / 2 + 1))
    return min(total, 1.0)


_MAX_CONDITION = 1e9
_UNDETERMINED = (
    "the common points coincide or lie on one line, which determines no transform; give points that span an area, for"
    " example at both sides of the spine"
)


def _design(q_mm: Float) -> Float:
    """Return the Jacobian (n, 3, 7) of points by translation, rotation and relative scale about their centroid."""
    J = np.zeros((len(q_mm), 3, _PARAMETERS))
    J[:, :, :3], J[:, :, 3:6], J[:, :, 6] = np.eye(3), -cross_matrix(q_mm), q_mm
    return J


def _block_diagonal(blocks: Float) -> Float:
    """Return the matrix (3n, 3n) of blocks (n, 3, 3)."""
    n = len(blocks)
    whole = np.zeros((n, 3, n, 3))
    whole[np.arange(n), :, np.arange(n), :] = blocks
    return whole.reshape(3 * n, 3 * n)


def _weighted_square(r: Float, covariance: Float, rank: int) -> float:
    """Return r^T C^+ r of a residual (m,) with a covariance (m, m) of known rank."""
    values, vectors = np.linalg.eigh(covariance)
    along = (vectors.T @ r)[-rank:]
    variances = values[-rank:]
    if not (variances > 0).all():
        return 0.0
    return float((along**2 / variances).sum())
