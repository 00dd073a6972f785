"""What is known of the triads from an earlier stage or other sources, and what it says of labels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations, pairwise

import numpy as np

from spinewatch.geometry.rotations import vector_from_rotation
from spinewatch.triads.label_parameters import LabelParameters
from spinewatch.triads.pose import MeasuredTriad, Pose

Assignment = tuple[int, ...]
"""Index of the label of each triad, in order along the spine."""


@dataclass(frozen=True, eq=False)
class KnownConfiguration:
    """Prior knowledge of the triads by vertebra.

    Attributes
    ----------
    poses
        Poses of an earlier stage, in any common frame.
    distances_mm
        Distances between pairs of vertebrae, for example from radiographs, mm; used where a pose is missing.
    markers
        Name of the marker on each vertebra, when there are several kinds.

    References
    ----------
    Heuristic H4 of thesis section 5.6.
    """

    poses: Mapping[str, Pose] = field(default_factory=dict)
    distances_mm: Mapping[tuple[str, str], float] = field(default_factory=dict)
    markers: Mapping[str, str] = field(default_factory=dict)

    def distance_mm(self, a: str, b: str) -> float | None:
        """Return the known distance between the triads of two vertebrae.

        Parameters
        ----------
        a, b
            Labels of the vertebrae.

        Returns
        -------
        float or None
            Distance, mm; None if it is not known.
        """
        if a in self.poses and b in self.poses:
            return float(np.linalg.norm(self.poses[a].position_mm - self.poses[b].position_mm))
        return self.distances_mm.get((a, b), self.distances_mm.get((b, a)))

    def covers(self, labels: Sequence[str]) -> bool:
        """Return whether all distances between vertebrae are known.

        Parameters
        ----------
        labels
            Labels of the vertebrae.

        Returns
        -------
        bool
            Whether the distance of every pair is known.
        """
        return all(self.distance_mm(a, b) is not None for a, b in combinations(labels, 2))


def known_problem(
    assignment: Assignment,
    ordered: Sequence[MeasuredTriad],
    labels: Sequence[str],
    p: LabelParameters,
    known: KnownConfiguration,
) -> str | None:
    """Return how an earlier stage contradicts an assignment: other vertebrae, or the opposite order.

    Parameters
    ----------
    assignment
        Index of the label of each triad.
    ordered
        Triads in order along the spine.
    labels
        Vertebrae in anatomical order.
    p
        Limits.
    known
        Known configuration; an empty one if there is none.

    Returns
    -------
    str or None
        Sentence with the labels; None if nothing contradicts the assignment.
    """
    named = [labels[k] for k in assignment]
    if len(known.poses) > 1 and not set(named) & set(known.poses):
        return (
            f"the labels are {', '.join(named)}, and the earlier stage has {', '.join(known.poses)}; give the names of"
            " the same vertebrae, or no earlier stage"
        )
    if len(named) < 2 or not all(name in known.poses for name in named):
        return None
    least = -0.5 * p.max_sigma**2 * (len(named) - 1)
    given, reverse = (
        configuration_likelihood(each, ordered, labels, p, known) for each in (assignment, assignment[::-1])
    )
    if reverse >= least and reverse - given >= np.log(p.min_likelihood_ratio):
        return (
            f"the triads fit the earlier stage in the opposite order, {', '.join(named[::-1])}; the labels follow"
            " increasing coordinate along the spine axis in both stages"
        )
    return None


def configuration_likelihood(
    assignment: Assignment,
    ordered: Sequence[MeasuredTriad],
    labels: Sequence[str],
    p: LabelParameters,
    known: KnownConfiguration,
) -> float:
    """Return the log-likelihood of the changes of distances and rotations of neighbours since a known configuration.

    Parameters
    ----------
    assignment
        Index of the label of each triad.
    ordered
        Triads in order along the spine.
    labels
        Vertebrae.
    p
        Deviations of the changes.
    known
        Known configuration with the distances of all neighbours.

    Returns
    -------
    float
        The log-likelihood without its constant.
    """
    total = 0.0
    for (i, a), (j, b) in pairwise(zip(assignment, ordered, strict=True)):
        distance = known.distance_mm(labels[i], labels[j]) or 0.0
        change_mm = float(np.linalg.norm(a.position_mm - b.position_mm)) - distance
        total -= 0.5 * (change_mm / p.distance_sd_mm) ** 2
    turned = rotation_sigmas(pairwise(zip(assignment, ordered, strict=True)), labels, p, known)
    return total - 0.5 * sum(min(sigma, p.max_rotation_sigma) ** 2 for sigma in turned)


def rotation_sigmas(
    pairs: Iterable[tuple[tuple[int, MeasuredTriad], tuple[int, MeasuredTriad]]],
    labels: Sequence[str],
    p: LabelParameters,
    known: KnownConfiguration,
) -> list[float]:
    """Return the changes of the rotations of pairs since a known configuration.

    Parameters
    ----------
    pairs
        Pairs of triads, each with the index of its label.
    labels
        Vertebrae.
    p
        Deviation of the changes.
    known
        Known configuration.

    Returns
    -------
    list of float
        Changes in standard deviations, of the pairs whose poses are known.
    """
    sigmas = []
    for (i, a), (j, b) in pairs:
        before = known.poses.get(labels[i]), known.poses.get(labels[j])
        if before[0] and before[1] and a.pose and b.pose:
            change = (a.pose.rotation.T @ b.pose.rotation).T @ (before[0].rotation.T @ before[1].rotation)
            angle = float(np.degrees(np.linalg.norm(vector_from_rotation(change))))
            sigmas.append(angle / p.rotation_sd_deg)
    return sigmas
