"""Covariances as errors of independent sources."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float


def covariance_factor(covariance: Float) -> Float:
    """Return a factor F of covariances with ``F F^T`` equal to them; they may be singular.

    Parameters
    ----------
    covariance
        Covariances, shape (..., k, k).

    Returns
    -------
    Float
        F, shape (..., k, k): one column per independent unit error.

    Examples
    --------
    >>> import numpy as np
    >>> F = covariance_factor(np.array([[1.0, 1.0], [1.0, 1.0]]))
    >>> (F @ F.T).round(9)
    array([[1., 1.],
           [1., 1.]])
    """
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.clip(values, 0, None))[..., None, :])
