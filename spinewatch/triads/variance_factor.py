"""The variance factor of a stage: how much larger errors are than the deviations that the networks stated.

A network states the deviations of its centres from what it saw in training. In an image unlike those the errors can be
larger, and the network does not know it. The residuals of the triads show it: the six images of the three balls of a
triad determine its six unknowns twice over, and all triads of a stage have the same light, blur and material. What all
images of a view share moves the triads without residuals, so that the factor does not show it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from spinewatch.flags import Flag
from spinewatch.triads.pose import MeasuredTriad


@dataclass(frozen=True)
class VarianceFactorParameters:
    """Prior knowledge of the variance factor.

    Attributes
    ----------
    enabled
        Whether the deviations of features are enlarged by it.
    expected
        Chi-square per degree of freedom of the residuals in images like those of the training, where the stated
        deviations, which hold for whatever may be seen there, are larger than the errors.
    prior_dof
        Weight of the expectation against the residuals, in degrees of freedom.
    max_usual
        Largest factor of a usual stage; above it the stage is flagged.
    """

    enabled: bool = True
    expected: float = 0.9
    prior_dof: float = 12.0
    max_usual: float = 1.4


def variance_factor(triads: Sequence[MeasuredTriad], parameters: VarianceFactorParameters) -> float:
    """Return the variance factor of the ball images of a stage.

    Parameters
    ----------
    triads
        Triads of the stage; those without a pose are not counted.
    parameters
        Prior knowledge.

    Returns
    -------
    float
        Factor of the covariances, at least 1.

    References
    ----------
    Variance of unit weight a posteriori: T. Luhmann et al., Close-Range Photogrammetry and 3D Imaging, section 2.4,
    here with a prior, because few triads determine it poorly. Not in the thesis.

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.triads.pose import Pose
    >>> pose = Pose(np.zeros(3), np.eye(3), np.eye(6))
    >>> triads = [MeasuredTriad("10-14-18", {}, pose, 0.1, chi2=chi2, dof=6) for chi2 in (9.0, 11.0, 8.0)]
    >>> round(variance_factor(triads, VarianceFactorParameters()), 2)
    1.44
    """
    p = parameters
    posed = [triad for triad in triads if triad.pose is not None]
    chi2, dof = sum(triad.chi2 for triad in posed), sum(triad.dof for triad in posed)
    return max(1.0, (p.prior_dof * p.expected + chi2) / ((p.prior_dof + dof) * p.expected))


def variance_flags(factor: float, parameters: VarianceFactorParameters) -> tuple[Flag, ...]:
    """Return the flag of a stage in which errors are larger than stated.

    Parameters
    ----------
    factor
        Its variance factor.
    parameters
        Limit of usual ones.

    Returns
    -------
    tuple of Flag
        "appearance-unusual", or none.

    Examples
    --------
    >>> [flag.code for flag in variance_flags(2.5, VarianceFactorParameters())]
    ['appearance-unusual']
    """
    if factor <= parameters.max_usual:
        return ()
    detail = (
        f"the residuals of the triads are {factor**0.5:.1f} times as large as in the images that the detector was"
        " trained with; all deviations were enlarged by that"
    )
    return (Flag("appearance-unusual", detail),)
