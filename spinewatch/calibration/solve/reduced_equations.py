"""Observation equations of a large block reduced image by image, and their least squares solution.

An image depends on the parameters of its camera and on its placement alone. Its equations are therefore reduced to a
triangle of those few columns, and the triangles are all that the normal equations need.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.calibration.solve.block import MOTION_NAMES, Block, ImageIndex

_MIN_DAMPING = 1e-12
_MAX_DAMPING = 1e12
_FIRST_DAMPING = 1e-4
_DECREASE, _INCREASE = 0.1, 10.0


@dataclass(frozen=True, eq=False)
class Evaluation:
    """The cost of unknowns, and the equations there.

    Attributes
    ----------
    cost
        Sum of squares, or of a robust loss; not finite out of view.
    equations
        Returns derivatives (k, u) and residuals (k,) whose Gauss-Newton step decreases the cost.
    """

    cost: float
    equations: Callable[[], tuple[Float, Float]]


@dataclass(frozen=True, eq=False)
class Minimum:
    """The end of an iteration.

    Attributes
    ----------
    x
        Unknowns, shape (u,).
    converged
        False when the limit of evaluations ended the iteration.
    """

    x: Float
    converged: bool


def image_columns(block: Block) -> dict[ImageIndex, list[int]]:
    """Return the unknowns on which each image depends.

    Parameters
    ----------
    block
        The block.

    Returns
    -------
    dict of ImageIndex to list of int
        Indices in `Block.unknown_names`.
    """
    first = np.cumsum([0, *map(len, block.free)]).tolist()
    n = len(MOTION_NAMES)

    def motion(s: int) -> range:
        return range(first[-1] + n * (s - 1), first[-1] + n * s) if s else range(0)

    return {(c, s): [*range(first[c], first[c + 1]), *motion(s)] for c, s in block.observation_slices}


def reduced(block: Block, jacobian: Float, residuals: Float) -> tuple[Float, Float]:
    """Return few equations with the same least squares solution, singular values and normal equations.

    Parameters
    ----------
    block
        The block.
    jacobian
        Derivatives of the residuals, shape (m, u), in the order of `Block.unknown_names`.
    residuals
        Weighted residuals, shape (m,).

    Returns
    -------
    jacobian : Float
        Derivatives of the reduced residuals, shape (k, u).
    residuals : Float
        Reduced residuals, shape (k,); their sum of squares is that of the residuals.

    References
    ----------
    G. H. Golub, C. F. Van Loan, Matrix Computations (2013), section 5.3: least squares by sequential QR.

    Examples
    --------
    >>> from spinewatch.calibration.control_field import pegboard_1995
    >>> from spinewatch.calibration.points import ImagePoints
    >>> from spinewatch.calibration.solve.parameterization import Parameterization, linearize
    >>> from spinewatch.geometry.transforms import RigidTransform
    >>> from spinewatch.simulation.rigs import table_3_3_rig
    >>> camera, field = table_3_3_rig().left, pegboard_1995()
    >>> image = ImagePoints.build(field.ids, field.points_mm, camera.project(field.points_mm) + 0.5)
    >>> block = Block((camera,), (RigidTransform.identity(),), {(0, 0): image}, (("f", "x0"),))
    >>> p = Parameterization.of(block)
    >>> at = linearize(p, p.pack())
    >>> J, r = reduced(block, at.jacobian, at.residuals)
    >>> J.shape, bool(np.allclose(J.T @ J, at.jacobian.T @ at.jacobian))
    ((3, 2), True)
    """
    rows = []
    u = jacobian.shape[1]
    for view, columns in image_columns(block).items():
        at = block.observation_slices[view]
        image = np.column_stack([jacobian[at][:, columns], residuals[at]])
        R = np.linalg.qr(image, mode="r")
        row = np.zeros((len(R), u + 1))
        row[:, [*columns, u]] = R
        rows.append(row)
    stacked = np.concatenate(rows)
    return stacked[:, :u], stacked[:, u]


def minimize(
    evaluate: Callable[[Float], Evaluation], x: Float, tolerance: float, max_evaluations: int
) -> Minimum:
    """Return the unknowns of least cost, by the algorithm of Levenberg and Marquardt.

    Parameters
    ----------
    evaluate
        From unknowns to cost and equations. A cost that is not finite is never accepted.
    x
        Initial values, shape (u,).
    tolerance
        Iteration ends when the cost changes by less than this fraction.
    max_evaluations
        Limit of evaluations.

    Returns
    -------
    Minimum
        The unknowns.

    Raises
    ------
    LinAlgError
        If the cost of the initial values is not finite.

    References
    ----------
    D. W. Marquardt, SIAM J. Appl. Math. 11 (1963) 431-441. Scaling: J. J. More, "The Levenberg-Marquardt algorithm"
    (1978).

    Examples
    --------
    >>> def line(x):
    ...     J, r = np.array([[1.0], [1.0]]), np.array([x[0] - 1, x[0] - 3])
    ...     return Evaluation(float(r @ r), lambda: (J, r))
    >>> minimize(line, np.array([10.0]), 1e-12, 50).x.round(6)
    array([2.])
    """
    at = evaluate(x)
    if not np.isfinite(at.cost):
        raise np.linalg.LinAlgError("the initial values are out of view")
    J, r = at.equations()
    damping, scale = _FIRST_DAMPING, np.zeros(len(x))
    for _ in range(max_evaluations - 1):
        scale = np.maximum(scale, np.linalg.norm(J, axis=0))
        step = _damped_step(J, r, np.where(scale > 0, scale, 1.0), damping)
        expected = float(r @ r - np.sum((r + J @ step) ** 2))
        moved = evaluate(x + step)
        gain = at.cost - moved.cost
        if np.isfinite(moved.cost) and gain >= 0:
            x, at = x + step, moved
            J, r = at.equations()
            damping = max(damping * _DECREASE, _MIN_DAMPING)
        else:
            damping *= _INCREASE
        small = abs(gain) <= tolerance * at.cost and expected <= tolerance * float(r @ r)
        if small or damping > _MAX_DAMPING or at.cost == 0:
            return Minimum(x, converged=True)
    return Minimum(x, converged=False)


def _damped_step(J: Float, r: Float, scale: Float, damping: float) -> Float:
    """Return the step that minimizes the linearized sum of squares and its own scaled, damped length."""
    A = np.concatenate([J, np.diag(np.sqrt(damping) * scale)])
    Q, R = np.linalg.qr(A / scale)
    return np.asarray(np.linalg.solve(R, -Q[: len(r)].T @ r) / scale)
