"""Inverses of many 2 x 2 and 3 x 3 matrices in closed form: for these, LAPACK spends most of its time on the calls."""

from __future__ import annotations

import numpy as np

from spinewatch.arrays import Float

_CYCLIC = np.array([0, 1, 2, 0, 1])
"""Rows and columns of a 3 x 3 matrix with which every cofactor is a difference of two products, without a sign."""


def inverse_2x2(A: Float) -> Float:
    """Return the inverses of matrices.

    Parameters
    ----------
    A
        Matrices, shape (..., 2, 2).

    Returns
    -------
    Float
        Inverses, shape (..., 2, 2); infinite or NaN for singular matrices.

    Examples
    --------
    >>> import numpy as np
    >>> inverse_2x2(np.array([[2.0, 3.0], [1.0, 2.0]]))
    array([[ 2., -3.],
           [-1.,  2.]])
    """
    adjugate = np.empty_like(A)
    adjugate[..., 0, 0], adjugate[..., 1, 1] = A[..., 1, 1], A[..., 0, 0]
    adjugate[..., 0, 1], adjugate[..., 1, 0] = -A[..., 0, 1], -A[..., 1, 0]
    determinant = A[..., 0, 0] * A[..., 1, 1] - A[..., 0, 1] * A[..., 1, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(adjugate / determinant[..., None, None])


def inverse_3x3(A: Float) -> tuple[Float, Float]:
    """Return the inverses and the determinants of matrices that lie along the last axis.

    Parameters
    ----------
    A
        Matrices, shape (3, 3, n).

    Returns
    -------
    inverse : Float
        Inverses, shape (3, 3, n); infinite or NaN for singular matrices.
    determinant : Float
        Determinants, shape (n,).

    Examples
    --------
    >>> import numpy as np
    >>> inverse, determinant = inverse_3x3(np.array([[1.0, 0, 0], [0, 2, 0], [1, 0, 4]])[..., None])
    >>> inverse[..., 0]
    array([[ 1.  ,  0.  ,  0.  ],
           [ 0.  ,  0.5 ,  0.  ],
           [-0.25,  0.  ,  0.25]])
    >>> determinant
    array([8.])
    """
    B = A[_CYCLIC][:, _CYCLIC]
    cofactors = B[1:4, 1:4] * B[2:, 2:] - B[1:4, 2:] * B[2:, 1:4]
    determinant = (A[0] * cofactors[0]).sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.swapaxes(cofactors, 0, 1) / determinant), determinant
