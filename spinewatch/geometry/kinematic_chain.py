"""Kinematic chains: products of rigid poses and their inverses, with Jacobians by the errors of every link."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.geometry.rotations import cross_matrix


@dataclass(frozen=True, eq=False)
class Link:
    """One factor of a chain: n poses, or their inverses.

    Attributes
    ----------
    position_mm
        Positions, shape (n, 3), mm.
    rotation
        Rotations, shape (n, 3, 3).
    inverted
        Whether the chain has the inverses of these poses.
    """

    position_mm: Float
    rotation: Float
    inverted: bool = False


@dataclass(frozen=True, eq=False)
class Chained:
    """The result of a chain.

    Attributes
    ----------
    position_mm
        Positions, shape (n, 3), mm.
    rotation
        Rotations, shape (n, 3, 3).
    by_link
        Jacobians of the errors of the result by those of each link, shape (n, 6, 6) each: position in mm, then a small
        rotation in degrees about the frame's axes, ``R_true = Exp(dtheta) R``, on both sides.
    by_last
        The same by the errors of the poses that the chain was applied to.
    """

    position_mm: Float
    rotation: Float
    by_link: tuple[Float, ...]
    by_last: Float


def chain_poses(links: Sequence[Link], position_mm: Float, rotation: Float) -> Chained:
    """Return the product of links, applied to poses: ``L_1 L_2 ... L_m B``.

    Parameters
    ----------
    links
        The links from left to right, n poses each.
    position_mm
        Positions of the poses B, shape (n, 3), mm.
    rotation
        Their rotations, shape (n, 3, 3).

    Returns
    -------
    Chained
        The product and its Jacobians.

    References
    ----------
    First order in the errors (dp, dtheta) of a link. A pose maps w to v = p + R w and its error moves v by
    ``dp + dtheta x (v - p)``; the error of an inverse moves the result by ``-R^T`` times the same. The links to the
    left rotate both.

    Examples
    --------
    >>> import numpy as np
    >>> at = Link(np.array([[10.0, 0, 0]]), np.eye(3)[None])
    >>> back = Link(at.position_mm, at.rotation, inverted=True)
    >>> chain_poses([at, back], np.array([[1.0, 2, 3]]), np.eye(3)[None]).position_mm
    array([[1., 2., 3.]])
    """
    arms: list[Float] = []
    point = position_mm
    for link in reversed(links):
        if link.inverted:
            arm = point - link.position_mm
            point = np.einsum("nji,nj->ni", link.rotation, arm)
        else:
            arm = np.einsum("nij,nj->ni", link.rotation, point)
            point = arm + link.position_mm
        arms.append(arm)
    before = np.broadcast_to(np.eye(3), rotation.shape)
    by_link: list[Float] = []
    for link, arm in zip(links, reversed(arms), strict=True):
        after = before @ (np.swapaxes(link.rotation, -1, -2) if link.inverted else link.rotation)
        turned = -after if link.inverted else before
        J = _same_for_both(turned)
        J[:, :3, 3:] = turned @ cross_matrix(arm) * -np.radians(1.0)
        by_link.append(J)
        before = after
    return Chained(np.asarray(point), before @ rotation, tuple(by_link), _same_for_both(before))


def _same_for_both(rotation: Float) -> Float:
    """Return Jacobians (n, 6, 6) that rotate the errors of positions and of rotations alike."""
    J = np.zeros((len(rotation), 6, 6))
    J[:, :3, :3] = J[:, 3:, 3:] = rotation
    return J
