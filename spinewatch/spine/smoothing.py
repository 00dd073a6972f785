"""The distribution of a quantity along the spine, given its measured values, their covariance and how smooth it is."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float

_STEP_DEVIATIONS = 4.0
"""By how many deviations, of noise and roughness together, a step must differ from zero: one disc in 16,000 has one
by chance."""


def smoothed(values: Float, covariance: Float, roughness: float) -> tuple[Float, Float]:
    """Return mean and covariance of a quantity along the spine, given its measured values.

    Where the values contradict the smoothness, there is a step between two neighbours: at a sharp curve, whose apex is
    a disc, or at a malformed vertebra. It is not smoothed.

    Parameters
    ----------
    values
        Measured values of consecutive vertebrae, shape (n,).
    covariance
        Covariance of their errors, shape (n, n).
    roughness
        Standard deviation of the third differences of the quantity along the spine, in its unit.

    Returns
    -------
    mean : Float
        Shape (n,); the measured values where the covariance is zero.
    covariance : Float
        Shape (n, n).

    References
    ----------
    Least squares with the measured values and, as observations of zero, their third differences: the smoothing of E. T.
    Whittaker, "On a new method of graduation", Proc. Edinburgh Math. Soc. 41 (1923) 63, with the weights given by the
    covariances and not chosen. Steps are found one by one, the most significant first, and each is let in as a random
    one of the size that was found: the interventions of A. C. Harvey and S. J. Koopman, "Diagnostic checking of
    unobserved-components time series models", J. Bus. Econ. Stat. 10 (1992) 377.

    Examples
    --------
    >>> mean, covariance = smoothed(np.array([0.0, 0, 1, 0, 0]), np.eye(5), 1e-9)
    >>> bool(np.abs(np.diff(mean, 3)).max() < 1e-9)
    True

    Noise of 1 is smoothed, a step of 30 is kept:

    >>> smoothed(np.array([0.0, 1, 0, 1, 30, 31, 30, 31]), np.eye(8), 1.0)[0].round(1)
    array([ 0.2,  0.4,  0.6,  0.8, 30.2, 30.4, 30.6, 30.8])
    """
    if len(values) < 4:
        return values, covariance
    D = np.diff(np.eye(len(values)), 3, axis=0)
    SD = covariance @ D.T
    C = D @ SD + _roughness_covariance(D @ values, D @ SD, D, roughness)
    gain = np.linalg.solve(C, SD.T).T
    return values - gain @ (D @ values), covariance - gain @ SD.T


def _roughness_covariance(thirds: Float, noise: Float, D: Float, roughness: float) -> Float:
    """Return the covariance of third differences (m,) that are not noise: of smooth ones and of the steps found.

    ``noise`` is the covariance (m, m) of their errors, ``D`` the operator (m, n) that they are made by.
    """
    steps = D @ np.tri(D.shape[1], D.shape[1] - 1, -1)
    P = roughness**2 * np.eye(len(D))
    while True:
        weighted = np.linalg.solve(noise + P, steps)
        score, precision = thirds @ weighted, np.sum(steps * weighted, axis=0)
        k = int(np.argmax(score**2 / precision))
        if score[k] ** 2 <= _STEP_DEVIATIONS**2 * precision[k]:
            return P
        P = P + (score[k] / precision[k]) ** 2 * np.outer(steps[:, k], steps[:, k])
