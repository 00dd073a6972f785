"""The output of 1995: triads relative to the reference as in Table 6.1, and their motion by eq. 6.1."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.flags import Flag
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.levels import anatomical_sequence
from spinewatch.spine.motion import ReferenceMissingError
from spinewatch.spine.plausibility import PlausibilityParameters, distance_flags, rotation_flags
from spinewatch.thesis_1995.motion import axis_and_angle, normal_from_angles
from spinewatch.triads.pose import Pose


@dataclass(frozen=True, eq=False)
class TriadRow:
    """One row of Table 6.1.

    Attributes
    ----------
    vertebra
        Label of the triad.
    position_mm, position_sd_mm
        P less that of the reference triad, object axes, and its deviations, shape (3,), mm.
    angles_deg
        Angles (alpha, beta, gamma) of the normal with the object axes, shape (3,), degrees.
    tilt_sd_deg
        Deviation of the direction of the normal about its least certain axis, degrees: a bound for that of each angle.
    """

    vertebra: str
    position_mm: Float
    position_sd_mm: Float
    angles_deg: Float
    tilt_sd_deg: float


@dataclass(frozen=True, eq=False)
class LegacyMotion:
    """Motion of one triad by eq. 6.1.

    Attributes
    ----------
    vertebra
        Label of the triad.
    axis
        Axis of the rotation between the normals, shape (3,), object axes; zero for parallel normals.
    angle_deg, angle_sd_deg
        Its angle, at most 90 degrees, and a bound of its deviation, degrees.
    displacement_mm, displacement_sd_mm
        Length of the displacement of P relative to the reference, and its deviation to first order, mm.
    """

    vertebra: str
    axis: Float
    angle_deg: float
    angle_sd_deg: float
    displacement_mm: float
    displacement_sd_mm: float


def triad_table(poses: Mapping[str, Pose], reference: str) -> tuple[TriadRow, ...]:
    """Return the rows of Table 6.1 for one stage.

    Parameters
    ----------
    poses
        Poses of the triads by vertebra, object space.
    reference
        Vertebra of the reference triad.

    Returns
    -------
    tuple of TriadRow
        One row per triad, in the order of ``poses``.

    Raises
    ------
    ReferenceMissingError
        If the reference has no pose.

    References
    ----------
    Thesis Table 6.1. Positions are relative to the reference, axes those of object space, so that a cart that turned
    between two stages shows as a motion; `spinewatch.spine.motion` has the axes of the reference triad instead.

    Examples
    --------
    >>> import numpy as np
    >>> at = lambda x: Pose(np.array([x, 0.0, 0.0]), np.eye(3), np.zeros((6, 6)))
    >>> triad_table({"L1": at(10.0), "T11": at(70.0)}, "L1")[1].position_mm
    array([60.,  0.,  0.])
    """
    if reference not in poses:
        raise ReferenceMissingError(
            f"reference {reference} was not measured in this stage; take it again or use another reference"
        )
    origin = poses[reference]
    return tuple(
        TriadRow(
            vertebra=vertebra,
            position_mm=pose.position_mm - origin.position_mm,
            position_sd_mm=np.zeros(3)
            if pose is origin
            else np.hypot(pose.position_sd_mm, origin.position_sd_mm),
            angles_deg=pose.angles_deg,
            tilt_sd_deg=float(pose.rotation_sd_deg[:2].max()),
        )
        for vertebra, pose in poses.items()
    )


def legacy_motion(before: Sequence[TriadRow], after: Sequence[TriadRow]) -> tuple[LegacyMotion, ...]:
    """Return the motion of every triad that both tables have, by eq. 6.1.

    Parameters
    ----------
    before, after
        Tables of the two stages.

    Returns
    -------
    tuple of LegacyMotion
        In the order of ``before``.

    References
    ----------
    Thesis eq. 6.1. It loses the rotation about the normal and folds angles beyond 90 degrees.

    Examples
    --------
    >>> import numpy as np
    >>> row = lambda angles: TriadRow("T9", np.zeros(3), np.zeros(3), np.array(angles), 0.0)
    >>> round(legacy_motion([row([90.0, 90.0, 0.0])], [row([90.0, 60.0, 30.0])])[0].angle_deg, 6)
    30.0
    """
    later = {row.vertebra: row for row in after}
    return tuple(_motion(row, later[row.vertebra]) for row in before if row.vertebra in later)


def legacy_flags(
    before: Sequence[TriadRow],
    after: Sequence[TriadRow],
    extra_levels: Sequence[str] = (),
    parameters: PlausibilityParameters | None = None,
) -> tuple[Flag, ...]:
    """Return flags of motions in two tables that a spine does not make.

    Parameters
    ----------
    before, after
        Tables of the two stages.
    extra_levels
        Vertebrae that this spine has in addition to the usual ones.
    parameters
        Limits; the default ones if None.

    Returns
    -------
    tuple of Flag
        ``intervertebral-distance-implausible`` and ``intervertebral-rotation-implausible``; a table has normals only,
        so that rotations about them are not seen.
    """
    p = parameters or PlausibilityParameters()
    old, new = ({row.vertebra: _pose(row) for row in rows} for rows in (before, after))
    sequence = anatomical_sequence(extra_levels)
    common = [name for name in sequence if name in old and name in new]
    numbers = {name: sequence.index(name) for name in common}
    return (*distance_flags(old, new, common, p), *rotation_flags(old, new, common, numbers, p))


def _motion(before: TriadRow, after: TriadRow) -> LegacyMotion:
    axis, angle = axis_and_angle(*(normal_from_angles(row.angles_deg) for row in (before, after)))
    shift = after.position_mm - before.position_mm
    length = float(np.linalg.norm(shift))
    unit = shift / length if length > 0 else np.zeros(3)
    variances = before.position_sd_mm**2 + after.position_sd_mm**2
    return LegacyMotion(
        vertebra=before.vertebra,
        axis=axis,
        angle_deg=angle,
        angle_sd_deg=float(np.hypot(before.tilt_sd_deg, after.tilt_sd_deg)),
        displacement_mm=length,
        displacement_sd_mm=float(np.sqrt(unit**2 @ variances)),
    )


def _pose(row: TriadRow) -> Pose:
    """Return a pose of the row's normal that is not turned about it."""
    normal = normal_from_angles(row.angles_deg)
    axis, _ = axis_and_angle(np.array([0.0, 0.0, 1.0]), normal)
    angle = np.arccos(np.clip(normal[2], -1.0, 1.0))
    variances = np.diag([*row.position_sd_mm**2, *[row.tilt_sd_deg**2] * 3])
    return Pose(row.position_mm, rotation_from_vector(angle * axis), variances)
