"""Triangulation (space intersection in the thesis): the points in which rays of two or more cameras meet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.geometry.projection import PinholeStack
from spinewatch.geometry.rays import Rays, nearest_points
from spinewatch.geometry.small_matrices import inverse_2x2, inverse_3x3

_MAX_STEPS = 10
_TOLERANCE_MM = 1e-10


@dataclass(frozen=True, eq=False)
class Triangulation:
    """n triangulated points.

    Attributes
    ----------
    position_mm
        Points, shape (n, 3), object space, mm.
    covariance_mm2
        Covariances propagated from the image points, shape (n, 3, 3), mm^2.
    parallax_mm
        Length of the common perpendicular of two rays, shape (n,), mm.
    chi2
        Chi-square of the image residuals, shape (n,), with 2k - 3 degrees of freedom for k rays.
    """

    position_mm: Float
    covariance_mm2: Float
    parallax_mm: Float
    chi2: Float


def triangulate(rays: Sequence[Rays]) -> Triangulation:
    """Return the maximum-likelihood points of the i-th rays of k cameras.

    Gauss-Newton on the collinearity equations, weighted by the covariance of the image points, from the nearest
    points of the rays.

    Parameters
    ----------
    rays
        Rays of each camera, n per camera.

    Returns
    -------
    Triangulation
        n points.

    References
    ----------
    Thesis eq. 3.4 and section 5.5. Residuals are taken on the undistorted image plane, which differs from pixels
    only by second-order terms.

    Examples
    --------
    >>> import numpy as np
    >>> from spinewatch.simulation.rigs import large_rig
    >>> rig, point = large_rig(), np.array([[100.0, 50.0, 20.0]])
    >>> rays = [camera.rays(camera.project(point), 0.1**2 * np.eye(2)) for camera in (rig.left, rig.right)]
    >>> triangulate(rays).position_mm.round(6)
    array([[100.,  50.,  20.]])
    """
    nearest, parallax = nearest_points(rays)
    cameras = PinholeStack.of([r.pinhole for r in rays])
    X = np.ascontiguousarray(nearest.T)
    observed = np.ascontiguousarray(np.swapaxes([r.ideal_mm for r in rays], 1, 2))
    weight = inverse_2x2(np.array([r.covariance_mm2 for r in rays])).transpose(0, 2, 3, 1)
    weight, covariance = np.ascontiguousarray(weight), np.empty((3, 3, len(nearest)))
    for _ in range(_MAX_STEPS):
        predicted, J = cameras.project(X)
        W_J = np.einsum("krsn,ksin->krin", weight, J)
        covariance, _ = inverse_3x3(np.einsum("krin,krjn->ijn", J, W_J))
        step = np.einsum("ijn,jn->in", covariance, np.einsum("krin,krn->in", W_J, observed - predicted))
        X = X + step
        if not np.any(np.abs(step) > _TOLERANCE_MM):
            break
    residual = observed - cameras.ideal(X)
    chi2 = np.einsum("krn,krn->n", residual, np.einsum("krsn,ksn->krn", weight, residual))
    return Triangulation(np.ascontiguousarray(X.T), np.ascontiguousarray(covariance.T), parallax, chi2)
