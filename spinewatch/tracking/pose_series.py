"""Poses of a burst as arrays: per label and pair, as small deviations from the label's mean pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Bool, Float
from spinewatch.geometry.rotations import nearest_rotation, rotation_from_vector, vector_from_rotation
from spinewatch.triads.pose import Pose

_KARCHER_STEPS = 3
_FLOOR = 1e-18
"""Added to variances, mm^2 and degrees^2, so that poses that are stated to be exact can be weighted."""


@dataclass(frozen=True, eq=False)
class PoseSeries:
    """Poses of m labels in n pairs.

    Attributes
    ----------
    labels
        The labels, in order of their first occurrence.
    present
        Whether a label has a pose in a pair, shape (m, n).
    deviation
        Deviation of each pose from the base pose, shape (m, n, 6): displacement, mm, and rotation vector about the
        object axes, degrees, with ``R = Exp(rotation) R_base``; zero where absent.
    covariance
        Covariance of each pose as stated, shape (m, n, 6, 6); the identity where absent.
    position_mm
        Positions of the base poses, shape (m, 3), object space, mm.
    rotation
        Rotations of the base poses, shape (m, 3, 3).
    """

    labels: tuple[str, ...]
    present: Bool
    deviation: Float
    covariance: Float
    position_mm: Float
    rotation: Float

    def pose(self, label: int, deviation: Float, covariance: Float) -> Pose:
        """Return a pose by its deviation from the base pose.

        Parameters
        ----------
        label
            Index of the label.
        deviation
            Displacement, mm, and rotation vector, degrees, shape (6,).
        covariance
            Covariance of the pose, shape (6, 6), mm and degrees.

        Returns
        -------
        Pose
            The pose.
        """
        turned = rotation_from_vector(np.radians(deviation[3:])) @ self.rotation[label]
        return Pose(self.position_mm[label] + deviation[:3], turned, covariance)


def pose_series(pairs: Sequence[Mapping[str, Pose]]) -> PoseSeries:
    """Return the poses of a burst as arrays.

    The base pose of a label is the mean of its positions and the mean of its rotations on the sphere of rotations: the
    rotation from which the rotation vectors to all others have the sum zero.

    Parameters
    ----------
    pairs
        Poses by label, object space, one mapping per pair.

    Returns
    -------
    PoseSeries
        The arrays.

    References
    ----------
    J. H. Manton, "A globally convergent numerical algorithm for computing the centre of mass on compact Lie groups",
    ICARCV 2004, 2211-2216.

    Examples
    --------
    >>> import numpy as np
    >>> at = lambda x: Pose(np.array([x, 0.0, 0.0]), np.eye(3), np.eye(6))
    >>> series = pose_series([{"L1": at(1.0)}, {"L1": at(3.0)}, {}])
    >>> series.position_mm[0, 0], series.deviation[0, :, 0]
    (np.float64(2.0), array([-1.,  1.,  0.]))
    """
    labels = tuple(dict.fromkeys(label for pair in pairs for label in pair))
    m, n = len(labels), len(pairs)
    present = np.array([[label in pair for pair in pairs] for label in labels], dtype=bool).reshape(m, n)
    deviation, covariance = np.zeros((m, n, 6)), np.tile(np.eye(6), (m, n, 1, 1))
    position, rotation = np.zeros((m, 3)), np.zeros((m, 3, 3))
    for i, label in enumerate(labels):
        at = np.flatnonzero(present[i])
        poses = [pair[label] for pair in pairs if label in pair]
        P, R = np.stack([p.position_mm for p in poses]), np.stack([p.rotation for p in poses])
        position[i], rotation[i] = P.mean(axis=0), mean_rotation(R)
        deviation[i, at, :3] = P - position[i]
        deviation[i, at, 3:] = np.degrees(vector_from_rotation(R @ rotation[i].T))
        covariance[i, at] = np.stack([p.covariance for p in poses]) + _FLOOR * np.eye(6)
    return PoseSeries(labels, present, deviation, covariance, position, rotation)


def mean_rotation(rotations: Float) -> Float:
    """Return the mean of rotations.

    Parameters
    ----------
    rotations
        Rotation matrices, shape (n, 3, 3), within 90 degrees of each other.

    Returns
    -------
    Float
        Rotation, shape (3, 3), from which the rotation vectors to all others have the sum zero.

    Examples
    --------
    >>> import numpy as np
    >>> turns = rotation_from_vector(np.radians([[0.0, 0.0, 10.0], [0.0, 0.0, 30.0]]))
    >>> np.degrees(vector_from_rotation(mean_rotation(turns))).round(9)
    array([ 0.,  0., 20.])
    """
    if len(rotations) == 1:
        return np.asarray(rotations[0])
    mean = nearest_rotation(rotations.mean(axis=0))
    for _ in range(_KARCHER_STEPS):
        mean = rotation_from_vector(vector_from_rotation(rotations @ mean.T).mean(axis=0)) @ mean
    return np.asarray(mean)
