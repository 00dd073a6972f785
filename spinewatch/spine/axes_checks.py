"""Checks of the patient axes against the bodies and triads of the baseline; NumPy only."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.flags import Flag
from spinewatch.geometry.rotations import rotation_from_vector, vector_from_rotation
from spinewatch.levels import level_numbers
from spinewatch.spine.configuration import InitialKind, SpineSetup
from spinewatch.spine.initial import InitialParameters
from spinewatch.spine.orientation import tilts_of
from spinewatch.spine.patient_axes import PatientAxesContradictedError
from spinewatch.spine.radiograph_fit import chi2_p_value
from spinewatch.triads.pose import Pose

_ITERATIONS = 10
_MIN_INFORMATION = 1e-9
"""Least information on a rotation that counts, degrees^-2: a deviation of 30,000 degrees."""

_AXES = ("x (anterior)", "y (left)", "z (cephalad)")


@dataclass(frozen=True)
class AxesCheckParameters:
    """Limits of what is known of the axes without the setup.

    Attributes
    ----------
    significance
        Probability of a rotation that is doubtful, for sound axes whose deviations are as stated.
    min_angle_deg
        Least rotation that is doubtful, degrees.
    refused_angle_deg
        Rotation above which axes are refused, degrees, if it is less probable than ``refused_significance`` too.
    refused_significance
        Probability, as of ``significance``, below which such a rotation is refused.
    axial_sd_deg
        Standard deviation of the axial rotation of a vertebra from what the curve explains, degrees: of its pose (3)
        and of its shape.
    coupling
        Mean axial rotation that goes with a coronal bend, degrees per degree and level. The bodies turn to the convex
        side; an apical rotation of 0.3 of the Cobb angle is -1.1.
    coupling_sd
        Its standard deviation among patients.
    posture_sd_deg
        Standard deviation of the rotation of a trunk without a curve against the patient axes, degrees.
    min_span_levels
        Least number of levels that axial rotations, or tilts against the line of the centroids, are compared over.
    tilt_sd_deg
        Standard deviation of the tilt of a vertebra from the line of the centroids, degrees.
    offset_dof
        Weight of `InitialParameters.triad_offset_sd_mm` against the scatter that the triads of a surgery show, in
        residuals.
    chain_angle_deg, chain_angle_per_level_deg, min_chain_angle_deg
        Angle between the cephalad axis and the line through both ends of a spine that is doubtful, degrees: the first
        less the second for each level, not below the third. Parts of a curve are inclined, whole spines hardly.
    chain_tolerance_mm
        How far beyond it the line through triads may end, whose places on their vertebrae differ, mm.
    max_back_angle_deg
        Angle between the mean normal of the triads and the posterior direction that is doubtful, degrees.
    """

    significance: float = 1e-3
    min_angle_deg: float = 12.0
    refused_angle_deg: float = 25.0
    refused_significance: float = 1e-6
    axial_sd_deg: float = 5.0
    coupling: float = -1.1
    coupling_sd: float = 0.8
    posture_sd_deg: float = 2.0
    min_span_levels: int = 4
    tilt_sd_deg: float = 6.0
    offset_dof: float = 6.0
    chain_angle_deg: float = 52.0
    chain_angle_per_level_deg: float = 2.0
    min_chain_angle_deg: float = 20.0
    chain_tolerance_mm: float = 20.0
    max_back_angle_deg: float = 45.0


@dataclass(frozen=True, eq=False)
class AxesEvidence:
    """A rotation of the true patient axes against the stated ones, as something else shows it.

    Attributes
    ----------
    shown
        What shows it, with a verb.
    rotation_deg
        Small rotation about the stated axes, shape (3,), degrees.
    information
        Inverse of its covariance without that of the stated axes, shape (3, 3), degrees^-2; zero about axes that it
        says nothing of.
    """

    shown: str
    rotation_deg: Float
    information: Float


def patient_axes_flags(
    setup: SpineSetup, triads: Mapping[str, Pose], parameters: AxesCheckParameters | None = None
) -> tuple[Flag, ...]:
    """Return flags of patient axes that the initial configuration or the triads of the baseline disagree with.

    Poses in object axes show how the bodies lie in the patient: where the spine does not bend sideways, it is not
    turned about its axis either. Poses in patient axes are compared with the triads, angles with the line of the
    centroids.

    Parameters
    ----------
    setup
        What is known of the surgery.
    triads
        Poses of the triads at the baseline stage by vertebra, object space.
    parameters
        Limits; the default ones if None.

    Returns
    -------
    tuple of Flag
        ``patient-axes-doubtful``, one for each that disagrees.

    Raises
    ------
    PatientAxesContradictedError
        If one of them shows axes that are turned by more than ``refused_angle_deg``.
    """
    p = parameters or AxesCheckParameters()
    doubts = (axes_doubt(evidence, setup.axes_covariance_deg2, p) for evidence in _evidence(setup, triads, p))
    flags = [Flag("patient-axes-doubtful", doubt) for doubt in doubts if doubt is not None]
    return (*flags, *_chain_flags(setup, triads, p), *_back_flags(setup, triads, p))


def axes_doubt(
    evidence: AxesEvidence, axes_covariance_deg2: Float, parameters: AxesCheckParameters | None = None
) -> str | None:
    """Return what a rotation shows that its deviation and that of the stated axes do not explain.

    Parameters
    ----------
    evidence
        The rotation.
    axes_covariance_deg2
        Covariance of the stated axes as of `SpineSetup.axes_covariance_deg2`, shape (3, 3), degrees^2.
    parameters
        Limits; the default ones if None.

    Returns
    -------
    str or None
        Detail of a flag; None where it is explained.

    Raises
    ------
    PatientAxesContradictedError
        If the rotation exceeds ``refused_angle_deg`` and ``refused_significance``.

    Examples
    --------
    >>> import numpy as np
    >>> film = AxesEvidence("the films show", np.array([0.0, 0.0, 20.0]), np.eye(3) / 9)
    >>> [axes_doubt(film, sd**2 * np.eye(3)) is None for sd in (3.0, 10.0)]
    [False, True]
    """
    p = parameters or AxesCheckParameters()
    values, vectors = np.linalg.eigh(evidence.information)
    seen = values > _MIN_INFORMATION
    if not seen.any():
        return None
    V = vectors[:, seen]
    turn = V.T @ evidence.rotation_deg
    covariance = np.diag(1 / values[seen]) + V.T @ axes_covariance_deg2 @ V
    angle = float(np.linalg.norm(turn))
    chi2 = float(turn @ np.linalg.solve(covariance, turn))
    probability = chi2_p_value(chi2, len(turn))
    if angle <= p.min_angle_deg or probability >= p.significance:
        return None
    vector = V @ turn
    detail = (
        f"{evidence.shown} patient axes that are turned by {angle:.0f} degrees against those of the setup, mostly about"
        f" {_AXES[int(np.argmax(np.abs(vector)))]}, {np.sqrt(chi2):.1f} times the deviation of that"
    )
    if angle > p.refused_angle_deg and probability < p.refused_significance:
        raise PatientAxesContradictedError(
            f"{detail}; check the patient axes and the initial configuration, or state a larger deviation of the axes"
        )
    return detail


def _evidence(
    setup: SpineSetup, triads: Mapping[str, Pose], p: AxesCheckParameters
) -> Iterator[AxesEvidence]:
    """Yield what the initial configuration shows of the axes."""
    initial = setup.initial
    if initial.kind is InitialKind.GENERIC:
        return
    by_axes = np.zeros((len(initial.levels), 6, 3)) if initial.by_axes is None else initial.by_axes
    turned = by_axes[:, 3:].any(axis=(1, 2))
    numbers = np.array(level_numbers(initial.levels, setup.extra_levels))
    rotation = setup.patient_axes.T @ initial.rotation
    position = initial.position_mm @ setup.patient_axes
    if by_axes[:, :3].any():
        yield from _of_triads(setup, triads, p)
        return
    free, given = np.flatnonzero(~turned), np.flatnonzero(turned)
    for rows, of in ((free, _of_axial_rotation), (given, _of_tilts)):
        if len(rows) >= 3 and numbers[rows[-1]] - numbers[rows[0]] >= p.min_span_levels:
            yield of(numbers[rows], position[rows], rotation[rows], p)


def _of_axial_rotation(
    numbers: Int, position: Float, rotation: Float, p: AxesCheckParameters
) -> AxesEvidence:
    """Return the rotation about z that the axial rotations of bodies have beside what goes with the coronal bend."""
    coronal, _, axial = tilts_of(rotation)
    bend = np.gradient(coronal, numbers)
    K = p.axial_sd_deg**2 * np.eye(len(bend)) + p.coupling_sd**2 * np.outer(bend, bend)
    weights = np.linalg.solve(K, np.ones(len(bend)))
    variance = 1 / float(weights.sum()) + p.posture_sd_deg**2
    turn = float(weights @ (axial - p.coupling * bend)) / float(weights.sum())
    information = np.diag([0.0, 0.0, 1 / variance])
    return AxesEvidence(
        "the axial rotations of the initial poses show", np.array([0.0, 0.0, turn]), information
    )


def _of_tilts(numbers: Int, position: Float, rotation: Float, p: AxesCheckParameters) -> AxesEvidence:
    """Return the rotation about x and y of positions in object axes against tilts that were given in patient axes."""
    coronal, sagittal, _ = tilts_of(rotation)
    up = position[:-1] - position[1:]
    chords = np.degrees(np.arctan2(up[:, [1, 0]] * (-1, 1), up[:, 2:]))
    tilts = np.stack([coronal, sagittal], axis=1)
    turn = (chords - (tilts[:-1] + tilts[1:]) / 2).mean(axis=0)
    variance = p.tilt_sd_deg**2 / len(numbers) + p.posture_sd_deg**2
    return AxesEvidence(
        "the line of the centroids against the angles shows",
        np.array([*turn, 0.0]),
        np.diag([1.0, 1.0, 0.0]) / variance,
    )


def _of_triads(
    setup: SpineSetup, triads: Mapping[str, Pose], p: AxesCheckParameters
) -> Iterator[AxesEvidence]:
    """Yield the rotation that brings poses in patient axes to their triads."""
    initial, limits = setup.initial, InitialParameters()
    rows = [i for i, name in enumerate(initial.levels) if name in triads]
    if len(rows) < 3:
        return
    A = setup.patient_axes
    shown = np.array([triads[initial.levels[i]].position_mm for i in rows]) @ A
    offset = np.array(limits.triad_offset_mm)
    expected = (initial.position_mm[rows] + initial.rotation[rows] @ offset) @ A
    shown, expected = shown - shown.mean(axis=0), expected - expected.mean(axis=0)
    # Rotations that the triads hardly show stay small.
    ridge = (limits.triad_offset_sd_mm / np.radians(p.refused_angle_deg)) ** 2 * np.eye(3)
    turn, K = np.eye(3), np.zeros((3, 3))
    for _ in range(_ITERATIONS):
        q = expected @ turn.T
        K = (q**2).sum() * np.eye(3) - q.T @ q
        turn = rotation_from_vector(np.linalg.solve(K + ridge, np.cross(q, shown).sum(axis=0))) @ turn
    left = shown - expected @ turn.T
    dof = 3 * len(rows) - 6
    variance = (p.offset_dof * limits.triad_offset_sd_mm**2 + (left**2).sum()) / (p.offset_dof + dof)
    yield AxesEvidence(
        "the triads against the initial poses show",
        np.degrees(vector_from_rotation(turn)),
        K * np.radians(1.0) ** 2 / variance,
    )


def _chain_flags(setup: SpineSetup, triads: Mapping[str, Pose], p: AxesCheckParameters) -> tuple[Flag, ...]:
    """Return a flag of a cephalad axis that the ends of the bodies, or else of the triads, do not run along."""
    initial = setup.initial
    levels: tuple[str, ...] = initial.levels
    position, what, tolerance = initial.position_mm, "the bodies", 0.0
    if initial.kind is InitialKind.GENERIC:
        levels, what, tolerance = tuple(triads), "the triads", p.chain_tolerance_mm
        position = np.array([triads[name].position_mm for name in levels])
    numbers = level_numbers(levels, setup.extra_levels)
    top, bottom = int(np.argmin(numbers)), int(np.argmax(numbers))
    if top == bottom:
        return ()
    span = numbers[bottom] - numbers[top]
    limit = max(p.min_chain_angle_deg, p.chain_angle_deg - p.chain_angle_per_level_deg * span)
    x, y, z = (position[top] - position[bottom]) @ setup.patient_axes
    aside = float(np.hypot(x, y))
    if aside - z * np.tan(np.radians(limit)) <= tolerance:
        return ()
    return (
        Flag(
            "patient-axes-doubtful",
            f"from {levels[bottom]} up to {levels[top]} {what} run {np.degrees(np.arctan2(aside, z)):.0f} degrees from"
            f" the cephalad axis, more than {limit:.0f}",
        ),
    )


def _back_flags(setup: SpineSetup, triads: Mapping[str, Pose], p: AxesCheckParameters) -> tuple[Flag, ...]:
    """Return a flag of an anterior axis that the triads do not face away from."""
    if not triads:
        return ()
    x, y, z = np.mean([triad.rotation[:, 2] for triad in triads.values()], axis=0) @ setup.patient_axes
    angle = float(np.degrees(np.arctan2(np.hypot(y, z), -x)))
    if angle <= p.max_back_angle_deg:
        return ()
    return (
        Flag(
            "patient-axes-doubtful",
            f"the triads face {angle:.0f} degrees from the posterior direction, more than {p.max_back_angle_deg:g}",
        ),
    )
