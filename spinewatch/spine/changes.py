"""Motion of each vertebra between two stages, from two configurations with the errors that they share; NumPy only."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.errors import ParameterError
from spinewatch.geometry.rotations import inverse_left_jacobian, variance_about, vector_from_rotation
from spinewatch.spine.configuration import Origin, SpineConfiguration
from spinewatch.spine.displacements import is_known
from spinewatch.spine.measure_functions import wrapped
from spinewatch.spine.orientation import tilt_gradients, tilts_of, twist_gradient, twist_of
from spinewatch.spine.results import VertebraChange
from spinewatch.spine.rotation_angle import angle_interval

_PRECEDENCE = tuple(Origin)

_STILL = "it is the reference vertebra, which the frame is fixed to"
"""Why the reference vertebra has no motion and no error of one."""


class LevelsDifferError(ParameterError):
    """Two configurations of different vertebrae."""

    code = "levels-differ"


def vertebra_changes(
    before: SpineConfiguration, after: SpineConfiguration, reference: str
) -> tuple[VertebraChange, ...]:
    """Return the motion of each vertebra from one stage to another.

    Parameters
    ----------
    before, after
        The spine at both stages, patient axes, of the same setup.
    reference
        Vertebra of the reference triad, which does not move by definition.

    Returns
    -------
    tuple of VertebraChange
        One per vertebra, from cranial to caudal; NaN and a reason where a stage has no pose of it. The reference has
        zeros without an error, and that reason.

    Raises
    ------
    LevelsDifferError
        If the configurations are not of the same vertebrae.

    References
    ----------
    Motion ``D = R_after R_before^T``; derotation is the twist about z of ``R_before^T R_after``; the length of the
    curve is that of the polyline through the centroids that both stages have. Errors to first order by source: a source
    that both configurations have is the same error in both, so that the initial configuration's cancels where it can.
    """
    if before.levels != after.levels:
        raise LevelsDifferError("the two stages have different vertebrae; compare stages of the same setup")
    rows = np.flatnonzero(
        is_known(before.poses.position_mm)
        & is_known(after.poses.position_mm)
        & is_known(before.poses.rotation)
        & is_known(after.poses.rotation)
    )
    R0, R1 = before.poses.rotation[rows], after.poses.rotation[rows]
    D = R1 @ np.swapaxes(R0, -1, -2)
    vectors = vector_from_rotation(D)
    variances = _variances(before, after, rows)
    tilt_changes = [wrapped(a - b) for a, b in zip(tilts_of(R1), tilts_of(R0), strict=True)]
    derotation = twist_of(np.swapaxes(R0, -1, -2) @ R1)
    length, length_sd = _distraction(before, after, reference)
    translation = after.poses.position_mm[rows] - before.poses.position_mm[rows]
    changes = []
    number = {int(row): i for i, row in enumerate(rows)}
    for row, name in enumerate(before.levels):
        if row not in number:
            changes.append(_unknown(name, before.reasons[row] or after.reasons[row]))
            continue
        i = number[row]
        J = inverse_left_jacobian(vectors[i])
        vector_covariance = J @ variances.rotation[i] @ J.T
        angle_lower, angle_upper = angle_interval(np.degrees(vectors[i]), vector_covariance)
        changes.append(
            VertebraChange(
                vertebra=name,
                origin=_PRECEDENCE[max(_PRECEDENCE.index(c.origins[row]) for c in (before, after))],
                reason=_STILL if name == reference else None,
                translation_mm=translation[i],
                translation_sd_mm=np.sqrt(variances.translation[i]),
                rotation=D[i],
                rotation_vector_deg=np.degrees(vectors[i]),
                rotation_sd_deg=np.sqrt(np.clip(np.diag(vector_covariance), 0, None)),
                angle_deg=float(np.degrees(np.linalg.norm(vectors[i]))),
                angle_sd_deg=float(np.sqrt(variance_about(vectors[i], variances.rotation[i]))),
                angle_lower_deg=angle_lower,
                angle_upper_deg=angle_upper,
                derotation_deg=float(derotation[i]),
                derotation_sd_deg=float(np.sqrt(variances.twist[i])),
                coronal_deg=float(tilt_changes[0][i]),
                coronal_sd_deg=float(np.sqrt(variances.tilts[i, 0])),
                sagittal_deg=float(tilt_changes[1][i]),
                sagittal_sd_deg=float(np.sqrt(variances.tilts[i, 1])),
                distraction_mm=float(length[row]),
                distraction_sd_mm=float(length_sd[row]),
            )
        )
    return tuple(changes)


class _Variances(NamedTuple):
    """Variances of the motions of m vertebrae: mm^2 and deg^2."""

    translation: Float
    """Of the displacement, (m, 3)."""
    rotation: Float
    """Covariance of a small rotation after the motion, (m, 3, 3)."""
    tilts: Float
    """Of the changes of coronal tilt, sagittal tilt and axial rotation, (m, 3)."""
    twist: Float
    """Of the derotation, (m,)."""


def _variances(before: SpineConfiguration, after: SpineConfiguration, rows: Int) -> _Variances:
    """Return the variances of the motions of some vertebrae, source by source."""
    R0, R1 = before.poses.rotation[rows], after.poses.rotation[rows]
    to_own = np.swapaxes(R0, -1, -2)
    D = R1 @ to_own
    twist_row = twist_gradient(to_own @ R1)[:, None] @ to_own
    g0, g1 = tilt_gradients(R0), tilt_gradients(R1)
    m = len(rows)
    total = _Variances(np.zeros((m, 3)), np.zeros((m, 3, 3)), np.zeros((m, 3)), np.zeros(m))
    for F0, F1 in _shared(before, after, rows):
        turned = F1[:, 3:] - D @ F0[:, 3:]
        twisted = twist_row @ (F1[:, 3:] - F0[:, 3:])
        total = _Variances(
            total.translation + ((F1[:, :3] - F0[:, :3]) ** 2).sum(axis=2),
            total.rotation + turned @ np.swapaxes(turned, -1, -2),
            total.tilts + ((g1 @ F1[:, 3:] - g0 @ F0[:, 3:]) ** 2).sum(axis=2),
            total.twist + (twisted[:, 0] ** 2).sum(axis=1),
        )
    return total


def _shared(
    before: SpineConfiguration, after: SpineConfiguration, rows: Int
) -> Iterator[tuple[Float, Float]]:
    """Yield the error factors (m, 6, r) of each source in both configurations; zero in one that does not have it."""
    for source in dict.fromkeys([*before.errors, *after.errors]):
        first, second = before.errors.get(source), after.errors.get(source)
        F0 = None if first is None else first[rows]
        F1 = None if second is None else second[rows]
        if F0 is None and F1 is not None:
            yield np.zeros_like(F1), F1
        elif F1 is None and F0 is not None:
            yield F0, np.zeros_like(F0)
        elif F0 is not None and F1 is not None:
            yield F0, F1


def _distraction(
    before: SpineConfiguration, after: SpineConfiguration, reference: str
) -> tuple[Float, Float]:
    """Return the changes of the lengths of the curve from the reference (n,) and their deviations, mm."""
    placed = is_known(before.poses.position_mm) & is_known(after.poses.position_mm)
    change, sd = np.full(len(placed), np.nan), np.full(len(placed), np.nan)
    if reference not in before.levels or not placed[before.index(reference)]:
        return change, sd
    rows = np.flatnonzero(placed)
    start = int(np.flatnonzero(rows == before.index(reference))[0])
    lengths, units = [], []
    for configuration in (before, after):
        chords = np.diff(configuration.poses.position_mm[rows], axis=0)
        length = np.linalg.norm(chords, axis=1)
        lengths.append(_from_start(length[:, None], start)[:, 0])
        units.append(chords / np.where(length > 0, length, 1)[:, None])
    change[rows] = lengths[1] - lengths[0]
    variance = np.zeros(len(rows))
    for F0, F1 in _shared(before, after, rows):
        along = [
            np.einsum("ij,ijr->ir", unit, np.diff(F[:, :3], axis=0))
            for unit, F in zip(units, (F0, F1), strict=True)
        ]
        variance += (_from_start(along[1] - along[0], start) ** 2).sum(axis=1)
    sd[rows] = np.sqrt(variance)
    return change, sd


def _from_start(steps: Float, start: int) -> Float:
    """Return sums of steps (m - 1, r) between m places, each from the start to the place, shape (m, r)."""
    total = np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])
    away = np.where(np.arange(len(total)) < start, -1.0, 1.0)
    return np.asarray(away[:, None] * (total - total[start]))


def _unknown(name: str, reason: str | None) -> VertebraChange:
    """Return the change of a vertebra that a stage has no pose of."""
    nan, nan3 = float("nan"), np.full(3, np.nan)
    return VertebraChange(
        name, Origin.NOT_MEASURED, reason, nan3, nan3, np.full((3, 3), np.nan), nan3, nan3, *(nan,) * 12
    )
