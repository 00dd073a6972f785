"""Initial poses that are mirrored or of another patient: the triads of the baseline fit a reversal of them better."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float
from spinewatch.flags import Flag
from spinewatch.geometry.rotations import cross_matrix
from spinewatch.spine.axes_errors import axes_factor
from spinewatch.spine.configuration import SpineSetup
from spinewatch.spine.initial import InitialParameters
from spinewatch.spine.radiograph_fit import chi2_p_value
from spinewatch.triads.pose import Pose

_REVERSALS = {
    "left and right exchanged": (1.0, -1.0, 1.0),
    "front and back exchanged": (-1.0, 1.0, 1.0),
    "left and right, and front and back, exchanged": (-1.0, -1.0, 1.0),
}
"""Signs of the patient's axes by what is wrong: a PA film that is read from the other side, a lateral one, or both."""


@dataclass(frozen=True)
class ReversalParameters:
    """How triads vary on their vertebrae, and what is doubtful.

    Of 998 sound simulated setups, whose clamps vary by 5 or 8 mm and 8 or 10 degrees (sd), none is flagged. With clamps
    that are 15 mm to the left or to the right 0.5% are said to be reversed. Clamps that vary by 10 mm and 12 degrees
    misfit in 1.3%, by 12 mm and 15 degrees in 14%. A ratio of 100 sees left and right exchanged in 83 instead of 74%
    of the larger curves, and flags 0.5% of the sound setups instead of none of 598. The figures of wider clamps and of
    the ratio come from experiments that no command repeats.

    Attributes
    ----------
    min_triads
        Least number of triads that are compared.
    normal_sd_deg
        Standard deviation of the normal of a triad about the posterior direction of its vertebra, per axis, degrees.
    common_normal_sd_deg
        Standard deviation of a tilt that all normals share, per axis, degrees: triads are turned towards the cameras.
    common_shift_mm
        Standard deviation of a displacement that all triads share, per axis, mm; it says nothing of the poses.
    scatter_dof
        Weight of the stated deviations against the scatter that the triads of a surgery show, in residuals.
    min_ratio
        How many times more likely the triads must be with a reversal.
    max_misfit
        Greatest reduced chi-square of the triads about the poses.
    significance
        Probability of the misfit of sound poses below which it is doubtful.
    """

    min_triads: int = 3
    normal_sd_deg: float = 10.0
    common_normal_sd_deg: float = 15.0
    common_shift_mm: float = 300.0
    scatter_dof: float = 6.0
    min_ratio: float = 1000.0
    max_misfit: float = 2.0
    significance: float = 1e-5


def initial_reversal_flags(
    setup: SpineSetup, triads: Mapping[str, Pose], parameters: ReversalParameters | None = None
) -> tuple[Flag, ...]:
    """Return flags of initial poses that the triads of the baseline do not fit.

    Each triad is expected `InitialParameters.triad_offset_mm` from its vertebra, with its normal along the posterior
    axis, and differs from that by the deviations of the clamps and of the poses. The same is expected of poses whose
    left and right, front and back, or both are exchanged.

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
        ``initial-poses-reversed`` if a reversal makes the triads ``min_ratio`` times more likely, or else
        ``initial-poses-misfit`` if their misfit is greater than that of clamps and poses.

    References
    ----------
    Student's t with ``scatter_dof`` degrees of freedom for the scatter, which is not known: the likelihood is
    ``(1 + chi2 / scatter_dof) ** (-(scatter_dof + dof) / 2)``. Clamps that differ from each other by more than stated
    then say less.
    """
    p = parameters or ReversalParameters()
    initial = setup.initial
    rows = [i for i, name in enumerate(initial.levels) if name in triads]
    if len(rows) < p.min_triads:
        return ()
    bodies = _Bodies.of(setup, rows)
    seen = [triads[initial.levels[i]] for i in rows]
    position = np.array([triad.position_mm for triad in seen]) @ setup.patient_axes
    rotation = setup.patient_axes.T @ np.array([triad.rotation for triad in seen])
    dof = 5 * len(rows) - 3
    given = _chi2(bodies, position, rotation, p)
    reversed_ = {
        name: _chi2(bodies.reversed(np.array(s)), position, rotation, p) for name, s in _REVERSALS.items()
    }
    best = min(reversed_, key=lambda name: reversed_[name])
    log_ratio = np.log1p(given / p.scatter_dof) - np.log1p(reversed_[best] / p.scatter_dof)
    if log_ratio * (p.scatter_dof + dof) / 2 > np.log(p.min_ratio):
        detail = (
            f"the triads fit the initial poses with {best} (misfit {reversed_[best] / dof:.1f} per degree of freedom)"
            f" and not as they are given ({given / dof:.1f}); check from which side the radiographs were read,"
            " the signs of the poses and the patient axes"
        )
        return (Flag("initial-poses-reversed", detail),)
    if given > p.max_misfit * dof and chi2_p_value(given, dof) < p.significance:
        detail = (
            f"the triads differ from where the initial poses expect them by {np.sqrt(given / dof):.1f} times what"
            " clamps and poses vary; check that the poses are of this patient in this position, and the names of the"
            " vertebrae"
        )
        return (Flag("initial-poses-misfit", detail),)
    return ()


@dataclass(frozen=True, eq=False)
class _Bodies:
    """Bodies with a triad: positions (m, 3), rotations (m, 3, 3) and errors (m, 6, r), patient axes."""

    position_mm: Float
    rotation: Float
    errors: Float

    @classmethod
    def of(cls, setup: SpineSetup, rows: list[int]) -> _Bodies:
        """Return the bodies of some rows of the initial configuration."""
        initial, A = setup.initial, setup.patient_axes
        factors = [initial.errors[rows]]
        if initial.by_axes is not None:
            factors.append(initial.by_axes[rows] @ axes_factor(setup.axes_covariance_deg2))
        errors = np.concatenate(factors, axis=2)
        turned = np.concatenate([A.T @ errors[:, :3], A.T @ errors[:, 3:]], axis=1)
        return cls(initial.position_mm[rows] @ A, A.T @ initial.rotation[rows], turned)

    def reversed(self, signs: Float) -> _Bodies:
        """Return the bodies with some of the patient's axes reversed about their middle; theirs stay right-handed."""
        F = np.diag(signs)
        # Rotation vectors are axial.
        errors = self.errors * np.concatenate([signs, np.prod(signs) * signs])[:, None]
        middle = self.position_mm.mean(axis=0)
        return _Bodies(middle + (self.position_mm - middle) * signs, F @ self.rotation @ F, errors)


def _chi2(bodies: _Bodies, position_mm: Float, rotation: Float, p: ReversalParameters) -> float:
    """Return the misfit of triads (m, 3) and (m, 3, 3), patient axes, about the bodies."""
    limits, m = InitialParameters(), len(position_mm)
    arm = bodies.rotation @ np.array(limits.triad_offset_mm)
    across = np.swapaxes(rotation[:, :, :2], 1, 2)
    residual = np.concatenate(
        [position_mm - bodies.position_mm - arm, _tilt_deg(-bodies.rotation[:, :, 0], rotation, across)],
        axis=1,
    )
    of_bodies = np.concatenate(
        [
            bodies.errors[:, :3] - np.radians(cross_matrix(arm)) @ bodies.errors[:, 3:],
            across @ bodies.errors[:, 3:],
        ],
        axis=1,
    )
    shift, tilt = np.zeros((m, 5, 3)), np.zeros((m, 5, 3))
    shift[:, :3], tilt[:, 3:] = p.common_shift_mm * np.eye(3), p.common_normal_sd_deg * across
    F = np.concatenate([of_bodies, shift, tilt], axis=2).reshape(5 * m, -1)
    own = np.tile([limits.triad_offset_sd_mm] * 3 + [p.normal_sd_deg] * 2, m)
    e = residual.ravel()
    return float(e @ np.linalg.solve(np.diag(own**2) + F @ F.T, e))


def _tilt_deg(expected: Float, rotation: Float, across: Float) -> Float:
    """Return how far the normals of triads are from directions (m, 3), about the triads' other axes (m, 2), degrees."""
    normal = rotation[:, :, 2]
    axis = np.cross(expected, normal)
    sine = np.linalg.norm(axis, axis=1)
    angle = np.degrees(np.arctan2(sine, (expected * normal).sum(axis=1)))
    vector = axis * (angle / np.maximum(sine, np.finfo(np.float64).tiny))[:, None]
    return np.asarray((across @ vector[:, :, None])[:, :, 0])
