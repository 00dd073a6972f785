"""How much of a vertebra's lateral displacement came with the direction and how much with the length of segments."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float

_LATERAL = np.array([0.0, -1.0, 0.0])
"""Direction to the patient's right."""


@dataclass(frozen=True, eq=False)
class DisplacementShares:
    """The parts of the lateral displacements of n vertebrae, and their gradients.

    Attributes
    ----------
    shares_mm
        Change, part of rotation, part of distraction, shape (n, 3), mm; the first is the sum of the others.
    before_gradient, after_gradient
        Their gradients by the centroids of all vertebrae at each stage, shape (n, 3, n, 3): vertebra, part, vertebra
        that moves, axis; mm per mm.
    """

    shares_mm: Float
    before_gradient: Float
    after_gradient: Float


def displacement_shares(
    before_mm: Float, after_mm: Float, parents: Sequence[int | None]
) -> DisplacementShares:
    """Return how much of the lateral displacements came with rotation and with distraction.

    Parameters
    ----------
    before_mm, after_mm
        Centroids at the earlier and at the later stage, shape (n, 3), patient axes, mm.
    parents
        For each vertebra the next one on the way to the reference vertebra; None for the reference, and for vertebrae
        without a way to it. A vertebra's way is the chain of its parents.

    Returns
    -------
    DisplacementShares
        NaN for vertebrae without a way to the reference.

    References
    ----------
    With length l and direction u of each segment of the way, the displacement is ``-sum(l u).Y``, and exactly
    ``l2 u2 - l1 u1 = (l2 - l1) (u1 + u2)/2 + (l1 + l2)/2 (u2 - u1)``: change of length at the mean direction
    (distraction), change of direction at the mean length (rotation).

    Examples
    --------
    Two segments that grow from 10 to 12 mm, the upper one inclined by 30 degrees to the right:

    >>> before = np.array([[0.0, -5.0, 18.66], [0.0, 0.0, 10.0], [0.0, 0.0, 0.0]])
    >>> displacement_shares(before, 1.2 * before, [1, 2, None]).shares_mm.round(6) + 0.0
    array([[1., 0., 1.],
           [0., 0., 0.],
           [0., 0., 0.]])
    """
    n = len(parents)
    shares = np.full((n, 3), np.nan)
    gradients = np.zeros((2, n, 3, n, 3))
    reference = {i for i in parents if i is not None and parents[i] is None}
    for i in reference:
        shares[i] = 0.0
    waiting = [i for i in range(n) if parents[i] is not None]
    while waiting:
        for i in list(waiting):
            parent = parents[i]
            if parent is None or parent in waiting:
                continue
            value, by_start, by_end = _segment(
                before_mm[i] - before_mm[parent], after_mm[i] - after_mm[parent]
            )
            shares[i] = shares[parent] + value
            for stage, by_segment in enumerate((by_start, by_end)):
                gradients[stage, i] = gradients[stage, parent]
                gradients[stage, i, :, i] += by_segment
                gradients[stage, i, :, parent] -= by_segment
            waiting.remove(i)
    return DisplacementShares(shares, gradients[0], gradients[1])


def distraction_excess(
    before_mm: Float,
    after_mm: Float,
    parents: Sequence[int | None],
    before_errors: Float,
    after_errors: Float,
) -> Float:
    """Return the variance of the parts of distraction that is of second order in the errors.

    The part of a segment is a product, change of length times mean direction. Where both are near zero, the variance of
    first order at the measured values exceeds the true one by about what is returned here.

    Parameters
    ----------
    before_mm, after_mm, parents
        As of `displacement_shares`.
    before_errors, after_errors
        Errors of the centroids by independent source, shape (n, 3, r), mm.

    Returns
    -------
    Float
        Shape (n,), mm^2.

    References
    ----------
    L. A. Goodman, "On the exact variance of products", J. Am. Stat. Assoc. 55 (1960) 708: the variance of a product
    from measured factors is ``x^2 var(y) + y^2 var(x) - var(x) var(y)``; here with all covariances of the segments.
    """
    n, r = len(parents), before_errors.shape[2]
    lengths, directions = np.zeros((2, n, r))
    for i, parent in enumerate(parents):
        if parent is None:
            continue
        for sign, c, e in ((-1.0, before_mm, before_errors), (1.0, after_mm, after_errors)):
            segment, error = c[i] - c[parent], e[i] - e[parent]
            length = np.linalg.norm(segment)
            u = segment / length
            lengths[i] += sign * (u @ error)
            directions[i] += (_LATERAL - u * (u @ _LATERAL)) @ error / (2 * length)
    ways = np.zeros((n, n))
    for i in range(n):
        node: int | None = i
        while node is not None:
            ways[i, node] = 1.0
            node = parents[node]
    cross = lengths @ directions.T
    covariance = (lengths @ lengths.T) * (directions @ directions.T) + cross * cross.T
    return np.asarray(np.einsum("is,st,it->i", ways, covariance, ways))


def _segment(start: Float, end: Float) -> tuple[Float, Float, Float]:
    """Return the three parts of a segment (3,) and their gradients (3, 3) by its vector at each stage."""
    l1, l2 = np.linalg.norm(start), np.linalg.norm(end)
    u1, u2 = start / l1, end / l2
    along = _LATERAL @ (u1 + u2) / 2
    across = _LATERAL @ (u2 - u1) / 2
    distraction = (l2 - l1) * along
    rotation = (l1 + l2) * across
    turn1, turn2 = (_LATERAL - u1 * (u1 @ _LATERAL)) / l1, (_LATERAL - u2 * (u2 @ _LATERAL)) / l2
    by_start = [u1 * across - (l1 + l2) / 2 * turn1, -u1 * along + (l2 - l1) / 2 * turn1]
    by_end = [u2 * across + (l1 + l2) / 2 * turn2, u2 * along + (l2 - l1) / 2 * turn2]
    return (
        np.array([_LATERAL @ (end - start), rotation, distraction]),
        np.array([-_LATERAL, *by_start]),
        np.array([_LATERAL, *by_end]),
    )
