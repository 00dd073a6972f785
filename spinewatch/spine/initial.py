"""The initial configuration from vertebra poses that are given: checks, order, and their place in object space."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from spinewatch.arrays import Float
from spinewatch.errors import ParameterError
from spinewatch.geometry.rotations import nearest_rotation, vector_from_rotation
from spinewatch.levels import LevelError, level_numbers, vertebra_names
from spinewatch.spine.axes_errors import turning
from spinewatch.spine.configuration import InitialKind, InitialSpine
from spinewatch.spine.orientation import twist_of
from spinewatch.spine.patient_axes import require_chain_along
from spinewatch.triads.pose import Pose


class InitialLevelsError(LevelError):
    """An initial configuration with too few vertebrae, or without one that carries a marker."""

    code = "initial-levels"


class InitialPoseError(ParameterError):
    """A pose of the initial configuration that is not finite, not rigid, reflected, or too near another one."""

    code = "initial-pose"


class InitialAnglesError(ParameterError):
    """Vertebrae of the initial configuration that are turned farther than those of any spine."""

    code = "initial-angles"


class InitialPlacementError(ParameterError):
    """Poses that the triads do not place in object space, or contradict."""

    code = "initial-placement"


@dataclass(frozen=True)
class InitialParameters:
    """How poses are checked and placed.

    Attributes
    ----------
    max_axes_error
        Greatest element of ``R^T R - I``; numbers with three decimals stay below it, and the nearest rotation is used.
    min_distance_mm
        Least distance between the centroids of two vertebrae, mm per level between them. Those of a child's neck are 9
        mm per level apart.
    triad_offset_mm
        P of a triad from the centroid of its vertebra, along the vertebra's own axes (anterior, left, cephalad), mm. A
        clamp on the spinous process holds a triad some 45 mm behind the centroid.
    triad_offset_sd_mm
        Its standard deviation per axis, mm.
    max_residual_mm
        Greatest distance of a triad from where the placed poses expect it, mm; beyond, the poses or the patient axes
        are those of another patient or position.
    max_shift_mm
        Greatest mean distance of the triads from where poses in object space expect them, mm: larger than the
        difference between any two holders of triads.
    max_coordinate_mm
        Greatest magnitude of a coordinate, mm.
    max_tilt_deg
        Greatest angle between the cephalad axes of a vertebra and of the patient, degrees.
    max_axial_deg
        Greatest axial rotation of a vertebra, degrees.
    max_step_deg
        Greatest rotation of a vertebra against its neighbour, degrees per level. A sharp kyphosis of 80 degrees over
        two levels stays below it.
    """

    max_axes_error: float = 5e-3
    min_distance_mm: float = 5.0
    triad_offset_mm: tuple[float, float, float] = (-45.0, 0.0, 0.0)
    triad_offset_sd_mm: float = 8.0
    max_residual_mm: float = 60.0
    max_shift_mm: float = 100.0
    max_coordinate_mm: float = 10_000.0
    max_tilt_deg: float = 90.0
    max_axial_deg: float = 90.0
    max_step_deg: float = 45.0


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
    turned_with_axes: Sequence[bool] | None = None,
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
        then place. In both, triads of the same vertebrae are compared with the poses.
    patient_axes
        Rotation from patient to object axes, shape (3, 3).
    triads
        Poses of the triads at the baseline stage by vertebra, object space.
    extra_levels
        Vertebrae that this spine has in addition.
    parameters
        How poses are checked and placed.
    turned_with_axes
        Which rotations were given in patient axes and are in object axes by the stated ones, shape (n,); None for all
        in frame ``patient``, and for none in ``object``.

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
        If a pose is not finite or out of range, its axes are not perpendicular unit vectors or are left-handed, or two
        are too near each other for the levels between them.
    InitialAnglesError
        If a vertebra is turned farther in the patient, or against its neighbour, than that of any spine.
    PatientAxesContradictedError
        If the vertebrae do not run along the cephalad axis.
    InitialPlacementError
        If poses in patient axes have no triad in common, or poses in either frame lie too far from the triads.

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
    with_axes = np.full(n, frame == "patient") if turned_with_axes is None else np.array(turned_with_axes)
    _check_levels(names, triads, extra_levels)
    _check_poses(names, position, R, sd, parameters)
    _check_distances(names, level_numbers(names, extra_levels), position, parameters)
    R = np.array([nearest_rotation(matrix) for matrix in R])
    if level_numbers(names, extra_levels)[0] > level_numbers(names, extra_levels)[-1]:
        names = names[::-1]
        position, R, sd, with_axes = position[::-1], R[::-1], sd[::-1], with_axes[::-1]
    errors = np.zeros((n, 6, 6 * n))
    for i in range(n):
        errors[i, :, 6 * i : 6 * i + 6] = np.diag(sd[i])
    seen, turned = (position, R) if frame == "patient" else (position @ patient_axes, patient_axes.T @ R)
    _check_angles(names, level_numbers(names, extra_levels), turned, parameters)
    require_chain_along(names, seen, "the initial configuration", extra_levels)
    shift = _shift_to_triads(names, seen, turned, patient_axes, triads, parameters)
    by_axes = np.zeros((n, 6, 3))
    by_axes[with_axes, 3:] = patient_axes
    if frame == "patient":
        shift, shift_sd = _placement(shift, len(set(names) & set(triads)), parameters)
        common_mm = [triads[name].position_mm for name in names if name in triads]
        by_axes[:, :3] = (
            patient_axes @ turning(position + shift - np.mean(common_mm, axis=0) @ patient_axes)[:, :3]
        )
        position, R = (position + shift) @ patient_axes.T, patient_axes @ R
        common = np.zeros((n, 6, 3))
        common[:, :3] = shift_sd * np.eye(3)
        errors = np.concatenate([errors, common], axis=2)
    else:
        _check_shift(shift, parameters)
    return InitialSpine(InitialKind.POSES, names, position, R, errors, by_axes if by_axes.any() else None)


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
    """Check that poses are finite, rigid and right-handed."""
    n = len(names)
    if position.shape != (n, 3) or R.shape != (n, 3, 3):
        raise InitialPoseError(f"{n} vertebrae need {n} positions of three numbers and {n} rotations of nine")
    axes_error = np.abs(np.swapaxes(R, -1, -2) @ R - np.eye(3)).max(axis=(1, 2))
    for i, name in enumerate(names):
        if not (np.isfinite(position[i]).all() and np.isfinite(R[i]).all() and (sd[i] >= 0).all()):
            raise InitialPoseError(
                f"pose of {name} is not finite, or a deviation is negative; correct its numbers"
            )
        if np.abs(position[i]).max() > parameters.max_coordinate_mm:
            raise InitialPoseError(
                f"position of {name} is beyond {parameters.max_coordinate_mm / 1000:g} m; give the centroid in mm"
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


def _check_distances(
    names: tuple[str, ...], numbers: Sequence[int], position: Float, parameters: InitialParameters
) -> None:
    """Check that centroids (n, 3) are apart by what the levels between them need."""
    n = len(names)
    levels = np.abs(np.subtract.outer(numbers, numbers)) + np.eye(n)
    distance = np.linalg.norm(position[:, None] - position, axis=2) + np.diag(np.full(n, np.inf))
    first, second = divmod(int(np.argmin(distance / levels)), n)
    least = parameters.min_distance_mm * levels[first, second]
    if distance[first, second] < least:
        raise InitialPoseError(
            f"{names[first]} and {names[second]} are {distance[first, second]:.1f} mm apart, less than {least:g} mm;"
            " give the centroid of each body in mm"
        )


def _check_angles(
    names: tuple[str, ...], numbers: Sequence[int], R: Float, parameters: InitialParameters
) -> None:
    """Check rotations (n, 3, 3) from vertebra to patient axes, from cranial to caudal."""
    tilts = np.degrees(np.arccos(np.clip(R[:, 2, 2], -1, 1)))
    for what, angles, limit in (
        ("tilted", tilts, parameters.max_tilt_deg),
        ("turned about the spine", np.abs(twist_of(R)), parameters.max_axial_deg),
    ):
        worst = int(np.argmax(angles))
        if angles[worst] > limit:
            raise InitialAnglesError(
                f"{names[worst]} is {what} by {angles[worst]:.0f} degrees in the patient, more than {limit:g}; check"
                " its angles, the frame of the poses and the patient axes"
            )
    steps = np.degrees(np.linalg.norm(vector_from_rotation(R[:-1].swapaxes(1, 2) @ R[1:]), axis=-1))
    excess = steps - parameters.max_step_deg * np.diff(numbers)
    worst = int(np.argmax(excess))
    if excess[worst] > 0:
        raise InitialAnglesError(
            f"{names[worst]} and {names[worst + 1]} are turned by {steps[worst]:.0f} degrees against each other, more"
            f" than {parameters.max_step_deg:g} per level; check their angles"
        )


def _shift_to_triads(
    names: tuple[str, ...],
    position: Float,
    R: Float,
    patient_axes: Float,
    triads: Mapping[str, Pose],
    parameters: InitialParameters,
) -> Float | None:
    """Return the translation (3,) that brings poses to their triads, patient axes, mm; None without a common one."""
    common = [i for i, name in enumerate(names) if name in triads]
    if not common:
        return None
    P = np.array([triads[names[i]].position_mm for i in common]) @ patient_axes
    expected = position[common] + R[common] @ np.array(parameters.triad_offset_mm)
    shift: Float = (P - expected).mean(axis=0)
    residuals = np.linalg.norm(P - expected - shift, axis=1)
    worst = int(np.argmax(residuals))
    if residuals[worst] > parameters.max_residual_mm:
        raise InitialPlacementError(
            f"triad {names[common[worst]]} is {residuals[worst]:.0f} mm from where the initial configuration expects"
            f" it, more than {parameters.max_residual_mm:g} mm; check the patient axes, the units and the patient"
        )
    return shift


def _placement(shift: Float | None, n_common: int, parameters: InitialParameters) -> tuple[Float, float]:
    """Return the translation (3,) of poses in patient axes and its deviation per axis, mm."""
    if shift is None:
        raise InitialPlacementError(
            "no vertebra of the initial configuration carries a triad that places it; give poses in object space, or"
            " the pose of a vertebra with a triad"
        )
    return shift, parameters.triad_offset_sd_mm / float(np.sqrt(n_common))


def _check_shift(shift: Float | None, parameters: InitialParameters) -> None:
    """Check that poses in object space are where the triads are."""
    distance = 0.0 if shift is None else float(np.linalg.norm(shift))
    if distance > parameters.max_shift_mm:
        raise InitialPlacementError(
            f"the triads are {distance:.0f} mm from where the initial configuration expects them, more than"
            f" {parameters.max_shift_mm:g} mm; check that the poses are in object space of the baseline stage, or"
            " give frame patient"
        )
