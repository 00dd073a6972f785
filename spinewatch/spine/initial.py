"""The initial configuration from vertebra poses that are given: checks, order, and their place in object space."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from spinewatch.arrays import Float
from spinewatch.errors import ParameterError
from spinewatch.geometry.rotations import nearest_rotation
from spinewatch.levels import LevelError, level_numbers, vertebra_names
from spinewatch.spine.configuration import InitialKind, InitialSpine
from spinewatch.triads.pose import Pose


class InitialLevelsError(LevelError):
    """An initial configuration with too few vertebrae, or without one that carries a marker."""

    code = "initial-levels"


class InitialPoseError(ParameterError):
    """A pose of the initial configuration that is not finite, not rigid, reflected, or where another one is."""

    code = "initial-pose"


class InitialPlacementError(ParameterError):
    """Poses in patient axes that the triads do not place in object space."""

    code = "initial-placement"


@dataclass(frozen=True)
class InitialParameters:
    """How poses are checked and placed.

    Attributes
    ----------
    max_axes_error
        Greatest element of ``R^T R - I``; numbers with three decimals stay below it, and the nearest rotation is used.
    min_distance_mm
        Least distance between the centroids of two vertebrae, mm.
    triad_offset_mm
        P of a triad from the centroid of its vertebra, along the vertebra's own axes (anterior, left, cephalad), mm. A
        clamp on the spinous process holds a triad some 45 mm behind the centroid.
    triad_offset_sd_mm
        Its standard deviation per axis, mm.
    max_residual_mm
        Greatest distance of a triad from where the placed poses expect it, mm; beyond, the poses or the patient axes
        are those of another patient or position.
    """

    max_axes_error: float = 5e-3
    min_distance_mm: float = 5.0
    triad_offset_mm: tuple[float, float, float] = (-45.0, 0.0, 0.0)
    triad_offset_sd_mm: float = 8.0
    max_residual_mm: float = 60.0


def initial_from_poses(  # noqa: PLR0913
    levels: Sequence[str],
    position_mm: Float,
    rotation: Float,
    position_sd_mm: Float | float,
    rotation_sd_deg: Float | float,
    *,
    frame: Literal["object", "patient"],
    patient_axes: Float,
    triads: Mapping[str, Pose],
    extra_levels: Sequence[str] = (),
    parameters: InitialParameters | None = None,
) -> InitialSpine:
    """Return the initial configuration of poses that were typed in or uploaded.

    Parameters
    ----------
    levels
        Names of the n vertebrae, downwards or upwards.
    position_mm
        Centroids of the bodies, shape (n, 3), mm.
    rotation
        Rotations from vertebra to the axes of ``frame``, shape (n, 3, 3); columns anterior, left, cephalad.
    position_sd_mm
        Standard deviation of a position per axis, one for all or shape (n,), mm.
    rotation_sd_deg
        Standard deviation of a rotation about each axis, one for all or shape (n,), degrees.
    frame
        Axes of the poses: ``object`` space of the baseline stage, or ``patient`` axes of any origin, which the triads
        then place.
    patient_axes
        Rotation from patient to object axes, shape (3, 3).
    triads
        Poses of the triads at the baseline stage by vertebra, object space.
    extra_levels
        Vertebrae that this spine has in addition.
    parameters
        How poses are checked and placed.

    Returns
    -------
    InitialSpine
        The poses in object space, from cranial to caudal, with their errors.

    Raises
    ------
    LevelError
        If a name is unknown, given twice or out of order.
    InitialLevelsError
        If there are fewer than two vertebrae, or one between them carries a triad and has no pose.
    InitialPoseError
        If a pose is not finite, its axes are not perpendicular unit vectors or are left-handed, or two coincide.
    InitialPlacementError
        If poses in patient axes have no triad in common, or lie too far from the triads.

    Examples
    --------
    >>> import numpy as np
    >>> spine = initial_from_poses(
    ...     ["L1", "T12"], np.array([[0.0, 0, 0], [0, 0, 30]]), np.stack([np.eye(3)] * 2), 1.0, 2.0,
    ...     frame="object", patient_axes=np.eye(3), triads={},
    ... )
    >>> spine.levels, spine.position_mm[0]
    (('T12', 'L1'), array([ 0.,  0., 30.]))
    """
    parameters = parameters or InitialParameters()
    names = vertebra_names(levels, extra_levels)
    n = len(names)
    position, R = np.asarray(position_mm, dtype=float), np.asarray(rotation, dtype=float)
    sd = np.repeat(
        np.stack([np.broadcast_to(position_sd_mm, n), np.broadcast_to(rotation_sd_deg, n)], axis=1), 3, axis=1
    )
    _check_levels(names, triads, extra_levels)
    _check_poses(names, position, R, sd, parameters)
    R = np.array([nearest_rotation(matrix) for matrix in R])
    if level_numbers(names, extra_levels)[0] > level_numbers(names, extra_levels)[-1]:
        names, position, R, sd = names[::-1], position[::-1], R[::-1], sd[::-1]
    errors = np.zeros((n, 6, 6 * n))
    for i in range(n):
        errors[i, :, 6 * i : 6 * i + 6] = np.diag(sd[i])
    if frame == "patient":
        shift, shift_sd = _shift_to_triads(names, position, R, patient_axes, triads, parameters)
        position, R = (position + shift) @ patient_axes.T, patient_axes @ R
        common = np.zeros((n, 6, 3))
        common[:, :3] = shift_sd * np.eye(3)
        errors = np.concatenate([errors, common], axis=2)
    return InitialSpine(InitialKind.POSES, names, position, R, errors)


def _check_levels(names: tuple[str, ...], triads: Mapping[str, Pose], extra_levels: Sequence[str]) -> None:
    """Check that there are enough vertebrae, and none with a triad missing between them."""
    if len(names) < 2:
        raise InitialLevelsError(
            "an initial configuration needs at least two vertebrae; give the pose of each one"
        )
    numbers = level_numbers(names, extra_levels)
    placed = tuple(triads)
    inside = (
        name
        for name, number in zip(placed, level_numbers(placed, extra_levels), strict=True)
        if min(numbers) < number < max(numbers) and name not in names
    )
    for name in inside:
        raise InitialLevelsError(f"vertebra {name} carries a triad and has no initial pose; add its pose")


def _check_poses(
    names: tuple[str, ...], position: Float, R: Float, sd: Float, parameters: InitialParameters
) -> None:
    """Check that poses are finite, rigid, right-handed and apart."""
    n = len(names)
    if position.shape != (n, 3) or R.shape != (n, 3, 3):
        raise InitialPoseError(f"{n} vertebrae need {n} positions of three numbers and {n} rotations of nine")
    axes_error = np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max(axis=(1, 2))
    for i, name in enumerate(names):
        if not (np.isfinite(position[i]).all() and np.isfinite(R[i]).all() and (sd[i] >= 0).all()):
            raise InitialPoseError(
                f"pose of {name} is not finite, or a deviation is negative; correct its numbers"
            )
        if axes_error[i] > parameters.max_axes_error:
            raise InitialPoseError(
                f"axes of {name} are not perpendicular unit vectors (off by {axes_error[i]:.3g}); give a rotation"
                " matrix whose columns are the anterior, left and cephalad axes"
            )
        if np.linalg.det(R[i]) < 0:
            raise InitialPoseError(
                f"axes of {name} are left-handed; reverse one of them so that anterior x left = cephalad"
            )
    distance = np.linalg.norm(position[:, None] - position, axis=2) + np.diag(np.full(n, np.inf))
    first, second = divmod(int(np.argmin(distance)), n)
    if distance[first, second] < parameters.min_distance_mm:
        raise InitialPoseError(
            f"{names[first]} and {names[second]} are {distance[first, second]:.1f} mm apart; give the"
            " centroid of each body in mm"
        )


def _shift_to_triads(
    names: tuple[str, ...],
    position: Float,
    R: Float,
    patient_axes: Float,
    triads: Mapping[str, Pose],
    parameters: InitialParameters,
) -> tuple[Float, float]:
    """Return the translation (3,) that brings poses to their triads, patient axes, and its deviation per axis, mm."""
    common = [i for i, name in enumerate(names) if name in triads]
    if not common:
        raise InitialPlacementError(
            "no vertebra of the initial configuration carries a triad that places it; give poses in object space, or"
            " the pose of a vertebra with a triad"
        )
    P = np.array([triads[names[i]].position_mm for i in common]) @ patient_axes
    expected = position[common] + R[common] @ np.array(parameters.triad_offset_mm)
    shift = (P - expected).mean(axis=0)
    residuals = np.linalg.norm(P - expected - shift, axis=1)
    worst = int(np.argmax(residuals))
    if residuals[worst] > parameters.max_residual_mm:
        raise InitialPlacementError(
            f"triad {names[common[worst]]} is {residuals[worst]:.0f} mm from where the initial configuration expects"
            f" it, more than {parameters.max_residual_mm:g} mm; check the patient axes, the units and the patient"
        )
    return shift, parameters.triad_offset_sd_mm / float(np.sqrt(len(common)))
