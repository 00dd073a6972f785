"""Plausibility of the motion between two stages: gates that raise flags, NumPy only."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from spinewatch.arrays import Float
from spinewatch.flags import Flag
from spinewatch.geometry.rotations import cross_matrix, rotation_from_vector, vector_from_rotation
from spinewatch.levels import anatomical_sequence
from spinewatch.triads.pose import Pose

_ITERATIONS = 3
_LEAST_VARIANCE = 1e-6
"""Variance that is added to every component (mm^2, degrees^2), so that poses without errors have a weight."""


@dataclass(frozen=True)
class PlausibilityParameters:
    """Limits of plausible motion between two stages.

    Attributes
    ----------
    min_others
        Least number of triads besides the reference that can show that the reference moved.
    reference_angle_deg, reference_shift_mm
        Least motion of the reference against the others that is flagged, degrees and mm; either is enough.
    reference_sigma
        How many deviations it must exceed.
    max_spread
        Largest reduced chi-square of the others about one rigid motion.
    max_growth
        Largest relative change of the distance between neighbouring triads.
    max_rotation_per_level_deg
        Largest change of the rotation between neighbouring vertebrae, degrees per level. A thoracic segment bends by 6
        to 10 degrees to either side (White and Panjabi).
    max_disagreement_deg, max_disagreement_mm
        Largest difference between the motion of a vertebra and what its two neighbours make of it, where both are up to
        two levels away, degrees and mm. With neighbours m and n levels away it is m n / (m + n) times as large: what a
        spine reaches that bends by the same angle per level, to opposite sides above and below.
    sigma
        How many deviations a difference must exceed a limit by.
    """

    min_others: int = 2
    reference_angle_deg: float = 3.0
    reference_shift_mm: float = 3.0
    reference_sigma: float = 5.0
    max_spread: float = 1.5
    max_growth: float = 0.17
    max_rotation_per_level_deg: float = 15.0
    max_disagreement_deg: float = 20.0
    max_disagreement_mm: float = 15.0
    sigma: float = 3.0


def plausibility_flags(
    before: Mapping[str, Pose],
    after: Mapping[str, Pose],
    reference: str,
    extra_levels: Sequence[str] = (),
    parameters: PlausibilityParameters | None = None,
) -> tuple[Flag, ...]:
    """Return flags of motions that a spine does not make.

    Parameters
    ----------
    before, after
        Poses of the triads by vertebra in two stages, object space of each stage.
    reference
        Vertebra of the reference triad.
    extra_levels
        Vertebrae that this spine has in addition to the usual ones.
    parameters
        Limits; the default ones if None.

    Returns
    -------
    tuple of Flag
        ``reference-moved``, ``intervertebral-distance-implausible``, ``intervertebral-rotation-implausible`` and
        ``neighbours-disagree``.

    Examples
    --------
    >>> import numpy as np
    >>> at = lambda x: Pose(np.array([x, 0.0, 0.0]), np.eye(3), np.eye(6) * 0.01)
    >>> [flag.code for flag in plausibility_flags(
    ...     {"L1": at(0), "T11": at(62)}, {"L1": at(0), "T11": at(75)}, "L1")]
    ['intervertebral-distance-implausible']
    """
    p = parameters or PlausibilityParameters()
    sequence = anatomical_sequence(extra_levels)
    common = [name for name in sequence if name in before and name in after]
    numbers = {name: sequence.index(name) for name in common}
    return (
        *_reference_flags(before, after, reference, common, p),
        *distance_flags(before, after, common, p),
        *rotation_flags(before, after, common, numbers, p),
        *_neighbour_flags(before, after, common, numbers, p),
    )


@dataclass(frozen=True, eq=False)
class RigidBodyMotion:
    """The rigid motion that several triads share.

    Attributes
    ----------
    rotation
        Rotation, shape (3, 3).
    centre_mm
        Mean position before, shape (3,), mm.
    shifted_mm
        Where the centre comes to lie, shape (3,), mm.
    covariance
        Covariance of a small shift (mm) and rotation (degrees) about the moved centre, shape (6, 6).
    reduced_chi_square
        Weighted squares of the residuals per degree of freedom: about 1 when the triads move as one body.
    """

    rotation: Float
    centre_mm: Float
    shifted_mm: Float
    covariance: Float
    reduced_chi_square: float


def shared_motion(before: Sequence[Pose], after: Sequence[Pose]) -> RigidBodyMotion:
    """Return the rigid motion that brings poses nearest to others, weighted by their covariances.

    Parameters
    ----------
    before, after
        Poses of the same triads, at least two.

    Returns
    -------
    RigidBodyMotion
        The motion with its covariance and the misfit of the poses.
    """
    centre = np.mean([pose.position_mm for pose in before], axis=0)
    R = after[0].rotation @ before[0].rotation.T
    shifted = np.mean([pose.position_mm for pose in after], axis=0)
    for _ in range(_ITERATIONS):
        rows = [_residual(b, a, R, centre, shifted) for b, a in zip(before, after, strict=True)]
        N = sum((J.T @ W @ J for _, J, W in rows), np.zeros((6, 6)))
        step = np.linalg.solve(N, sum((J.T @ W @ e for e, J, W in rows), np.zeros(6)))
        shifted = shifted + step[:3]
        R = rotation_from_vector(np.radians(step[3:])) @ R
    last = [_residual(b, a, R, centre, shifted) for b, a in zip(before, after, strict=True)]
    misfit = sum(float(e @ W @ e) for e, _, W in last)
    covariance: Float = np.asarray(np.linalg.inv(N), dtype=np.float64)
    return RigidBodyMotion(R, centre, shifted, covariance, misfit / (6 * (len(before) - 1)))


def _residual(
    before: Pose, after: Pose, R: Float, centre: Float, shifted: Float
) -> tuple[Float, Float, Float]:
    """Return residual (6,), its Jacobian for a shift and rotation about the moved centre, and its weight (6, 6)."""
    arm = R @ (before.position_mm - centre)
    turn = vector_from_rotation(after.rotation @ before.rotation.T @ R.T)
    residual = np.concatenate([after.position_mm - shifted - arm, np.degrees(turn)])
    J = np.eye(6)
    J[:3, 3:] = -cross_matrix(arm) * np.radians(1.0)
    turned = np.kron(np.eye(2), R)
    covariance = after.covariance + turned @ before.covariance @ turned.T + _LEAST_VARIANCE * np.eye(6)
    return residual, J, np.asarray(np.linalg.inv(covariance), dtype=np.float64)


def _reference_flags(
    before: Mapping[str, Pose],
    after: Mapping[str, Pose],
    reference: str,
    common: Sequence[str],
    p: PlausibilityParameters,
) -> Iterator[Flag]:
    others = [name for name in common if name != reference]
    if reference not in common or len(others) < p.min_others:
        return
    motion = shared_motion([before[name] for name in others], [after[name] for name in others])
    if motion.reduced_chi_square > p.max_spread:
        return
    e, J, W = _residual(
        before[reference], after[reference], motion.rotation, motion.centre_mm, motion.shifted_mm
    )
    shift, angle = float(np.linalg.norm(e[:3])), float(np.linalg.norm(e[3:]))
    S = np.linalg.inv(W) + J @ motion.covariance @ J.T
    sigma = float(np.sqrt(e @ np.linalg.solve(S, e)))
    if sigma > p.reference_sigma and (angle > p.reference_angle_deg or shift > p.reference_shift_mm):
        yield Flag(
            "reference-moved",
            f"the reference triad {reference} moved by {shift:.1f} mm and {angle:.1f} degrees against"
            f" {', '.join(others)}, which did not move among each other; look whether its clamp slipped, or name"
            " another reference",
        )


def distance_flags(
    before: Mapping[str, Pose],
    after: Mapping[str, Pose],
    common: Sequence[str],
    parameters: PlausibilityParameters,
) -> Iterator[Flag]:
    """Yield a flag for each pair of neighbours whose distance changed too much.

    Parameters
    ----------
    before, after
        Poses of the triads by vertebra.
    common
        Vertebrae of both stages, in anatomical order.
    parameters
        Limits.

    Yields
    ------
    Flag
        ``intervertebral-distance-implausible``.
    """
    p = parameters
    for upper, lower in pairwise(common):
        old, new = (_distance(poses[upper], poses[lower]) for poses in (before, after))
        sd = float(np.hypot(old[1], new[1]))
        if abs(new[0] - old[0]) > p.max_growth * old[0] + p.sigma * sd:
            yield Flag(
                "intervertebral-distance-implausible",
                f"the triads of {upper} and {lower} were {old[0]:.1f} mm apart and are {new[0]:.1f} mm apart, a change"
                f" of {100 * (new[0] / old[0] - 1):+.0f}%; look whether a marker was clamped again",
            )


def _distance(a: Pose, b: Pose) -> tuple[float, float]:
    """Return the distance between two triads and its deviation, mm."""
    between = a.position_mm - b.position_mm
    distance = float(np.linalg.norm(between))
    unit = between / max(distance, np.finfo(np.float64).tiny)
    return distance, float(np.sqrt(unit @ (a.covariance[:3, :3] + b.covariance[:3, :3]) @ unit))


def rotation_flags(
    before: Mapping[str, Pose],
    after: Mapping[str, Pose],
    common: Sequence[str],
    numbers: Mapping[str, int],
    parameters: PlausibilityParameters,
) -> Iterator[Flag]:
    """Yield a flag for each pair of neighbours that turned too far against each other.

    Parameters
    ----------
    before, after
        Poses of the triads by vertebra.
    common
        Vertebrae of both stages, in anatomical order.
    numbers
        Places of the vertebrae in the anatomical sequence.
    parameters
        Limits.

    Yields
    ------
    Flag
        ``intervertebral-rotation-implausible``.
    """
    p = parameters
    for upper, lower in pairwise(common):
        turned = [poses[lower].rotation.T @ poses[upper].rotation for poses in (before, after)]
        angle = _angle_deg(turned[1] @ turned[0].T)
        levels = numbers[lower] - numbers[upper]
        sd = _rotation_sd_deg(before[upper], before[lower], after[upper], after[lower])
        if angle > p.max_rotation_per_level_deg * levels + p.sigma * sd:
            yield Flag(
                "intervertebral-rotation-implausible",
                f"{upper} turned by {angle:.1f} degrees against {lower}, {angle / levels:.1f} degrees per level; look"
                " whether a marker was clamped again",
            )


def _neighbour_flags(
    before: Mapping[str, Pose],
    after: Mapping[str, Pose],
    common: Sequence[str],
    numbers: Mapping[str, int],
    p: PlausibilityParameters,
) -> Iterator[Flag]:
    for upper, middle, lower in zip(common, common[1:], common[2:], strict=False):
        turn, shift, sd_deg, sd_mm = _disagreement(before, after, (upper, middle, lower), numbers)
        above, below = numbers[middle] - numbers[upper], numbers[lower] - numbers[middle]
        wider = max(above * below / (above + below), 1.0)
        if (
            turn > wider * p.max_disagreement_deg + p.sigma * sd_deg
            or shift > wider * p.max_disagreement_mm + p.sigma * sd_mm
        ):
            yield Flag(
                "neighbours-disagree",
                f"{middle} moved by {turn:.1f} degrees and {shift:.1f} mm from where its neighbours {upper} and {lower}"
                " carry it; look whether its marker was clamped again or touched",
            )


def _disagreement(
    before: Mapping[str, Pose],
    after: Mapping[str, Pose],
    levels: tuple[str, str, str],
    numbers: Mapping[str, int],
) -> tuple[float, float, float, float]:
    """Return rotation (degrees) and displacement (mm) of a triad from its neighbours' motion, and their deviations."""
    upper, middle, lower = levels
    weight = (numbers[middle] - numbers[lower]) / (numbers[upper] - numbers[lower])
    # The frame of the lower neighbour takes out the motion of the rig.
    motions = []
    for name in (upper, middle):
        frames = [(poses[lower].rotation.T, poses[lower].position_mm) for poses in (before, after)]
        pose = [poses[name] for poses in (before, after)]
        position = [R @ (q.position_mm - t) for (R, t), q in zip(frames, pose, strict=True)]
        rotation = [R @ q.rotation for (R, _), q in zip(frames, pose, strict=True)]
        motions.append((rotation[1] @ rotation[0].T, position[0], position[1]))
    (R_upper, _, _), (R_middle, old, new) = motions
    R = rotation_from_vector(weight * vector_from_rotation(R_upper))
    predicted = R @ old + weight * (motions[0][2] - R_upper @ motions[0][1])
    poses = [each[name] for each in (before, after) for name in levels]
    sd_deg = _rotation_sd_deg(*poses)
    lever = np.radians(sd_deg) * float(np.linalg.norm(old))
    sd_mm = float(np.sqrt(sum(np.linalg.eigvalsh(q.covariance[:3, :3])[-1] for q in poses) + lever**2))
    return _angle_deg(R_middle @ R.T), float(np.linalg.norm(new - predicted)), sd_deg, sd_mm


def _angle_deg(R: Float) -> float:
    return float(np.degrees(np.linalg.norm(vector_from_rotation(R))))


def _rotation_sd_deg(*poses: Pose) -> float:
    """Return an upper bound of the deviation of a rotation made of several, degrees."""
    return float(np.sqrt(sum(np.linalg.eigvalsh(pose.covariance[3:, 3:])[-1] for pose in poses)))
