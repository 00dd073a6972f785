"""The distribution of a quantity along the spine, given its measured values, their covariance and how smooth it is."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float


def smoothed(values: Float, covariance: Float, roughness: float) -> tuple[Float, Float]:
    """Return mean and covariance of a quantity along the spine, given its measured values.

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
    covariances and not chosen.

    Examples
    --------
    >>> mean, covariance = smoothed(np.array([0.0, 0, 1, 0, 0]), np.eye(5), 1e-9)
    >>> bool(np.abs(np.diff(mean, 3)).max() < 1e-9)
    True
    """
    if len(values) < 4:
        return values, covariance
    D = np.diff(np.eye(len(values)), 3, axis=0)
    SD = covariance @ D.T
    gain = np.linalg.solve(D @ SD + roughness**2 * np.eye(len(D)), SD.T).T
    return values - gain @ (D @ values), covariance - gain @ SD.T
