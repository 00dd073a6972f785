"""Whether the vertebrae of an initial configuration are named one or two levels off, by where the triads are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from spinewatch.arrays import Float
from spinewatch.flags import Flag
from spinewatch.geometry.rotations import cross_matrix, nearest_rotation
from spinewatch.levels import level_numbers
from spinewatch.spine.configuration import InitialSpine
from spinewatch.spine.initial import InitialParameters
from spinewatch.spine.radiograph_fit import chi2_p_value
from spinewatch.triads.pose import Pose


@dataclass(frozen=True)
class LevelShiftParameters:
    """Prior knowledge of where triads are on their vertebrae, and limits.

    Attributes
    ----------
    holders
        Place of a triad on its vertebra, and its deviation, which is each triad's own.
    common_sd_mm
        Deviation per axis that all triads of a surgery share, because their holders are alike, mm; assumed.
    placed_sd_mm
        The same where the triads have placed the poses, mm: nothing is known of a common shift.
    shifts
        Levels by which the names may be off.
    min_ratio
        How many times likelier the triads must be with other names.
    max_p_value
        Probability of triads as far from their vertebrae below which they are flagged.
    """

    holders: InitialParameters = field(default_factory=InitialParameters)
    common_sd_mm: float = 5.0
    placed_sd_mm: float = 1000.0
    shifts: tuple[int, ...] = (-2, -1, 1, 2)
    min_ratio: float = 100.0
    max_p_value: float = 1e-4


def level_shift_flags(
    initial: InitialSpine,
    triads: Mapping[str, Pose],
    extra_levels: Sequence[str] = (),
    parameters: LevelShiftParameters | None = None,
    *,
    placed_by_triads: bool = False,
) -> tuple[Flag, ...]:
    """Return a flag if the triads are much likelier with the vertebrae named otherwise, or far from their vertebrae.

    The place of each triad in the axes of its vertebra is compared with that of a usual holder. With the names off by a
    level it is compared with the next vertebra; poses follow linearly between those given, and beyond the ends.

    Parameters
    ----------
    initial
        The initial configuration in object space.
    triads
        Poses of the triads at the baseline by vertebra, object space.
    extra_levels
        Vertebrae that this spine has in addition to the usual ones.
    parameters
        Prior knowledge and limits; the default ones if None.
    placed_by_triads
        Whether the triads placed the poses in object space, so that their mean distance tells nothing.

    Returns
    -------
    tuple of Flag
        ``initial-levels-shifted`` or ``initial-far-from-triads``, or none.
    """
    p = parameters or LevelShiftParameters()
    names = [name for name in initial.levels if name in triads]
    if not names or len(initial.levels) < 2:
        return ()
    numbers = np.array(level_numbers(initial.levels, extra_levels), dtype=float)
    at = np.array(level_numbers(names, extra_levels), dtype=float)
    poses = [triads[name] for name in names]
    common_sd = p.placed_sd_mm if placed_by_triads else p.common_sd_mm
    given = _misfit(initial, numbers, at, poses, common_sd, p)
    others = {shift: _misfit(initial, numbers, at + shift, poses, common_sd, p) for shift in p.shifts}
    best = min(others, key=lambda shift: others[shift].log_cost)
    # Between vague poses the mean of two is less vague, and likelier for that alone: the misfit must be less, too.
    lead = min(given.log_cost - others[best].log_cost, 0.5 * (given.chi2 - others[best].chi2))
    ratio = float(np.exp(np.clip(lead, -700, 700)))
    if ratio >= p.min_ratio:
        detail = (
            f"the triads are {given.distance_mm:.0f} mm from where the initial vertebrae of their names expect them,"
            f" and {others[best].distance_mm:.0f} mm from where those {_text(best)} do, which is {_times(ratio)} times"
            " likelier; check the names of the vertebrae in the radiographs or poses, and those of the triads"
        )
        return (Flag("initial-levels-shifted", detail),)
    p_value = chi2_p_value(given.chi2, 3 * len(names))
    if p_value < p.max_p_value:
        detail = (
            f"the triads are {given.distance_mm:.0f} mm from where the initial configuration expects them (chi-squared"
            f" {given.chi2:.0f} of {3 * len(names)}); check the names of the vertebrae, the patient, and the place of"
            " the poses"
        )
        return (Flag("initial-far-from-triads", detail),)
    return ()


@dataclass(frozen=True)
class _Misfit:
    """How triads fit vertebrae: negative log-likelihood but for a constant, chi-squared, and RMS distance, mm."""

    log_cost: float
    chi2: float
    distance_mm: float


def _misfit(
    initial: InitialSpine,
    numbers: Float,
    at: Float,
    poses: Sequence[Pose],
    common_sd_mm: float,
    p: LevelShiftParameters,
) -> _Misfit:
    """Return how triads (k) fit the vertebrae at numbers (k,) of the anatomical sequence."""
    k = len(poses)
    weight = _interpolation(numbers, at)
    centre = weight @ initial.position_mm
    R = np.stack([nearest_rotation(each) for each in np.einsum("kn,nij->kij", weight, initial.rotation)])
    factor = np.einsum("kn,nir->kir", weight, initial.errors)
    arm = R @ np.array(p.holders.triad_offset_mm)
    residual = (np.array([pose.position_mm for pose in poses]) - centre - arm).reshape(3 * k)
    F = factor[:, :3] - np.radians(cross_matrix(arm) @ factor[:, 3:])
    F = np.concatenate([F.reshape(3 * k, -1), common_sd_mm * R.reshape(3 * k, 3)], axis=1)
    S = F @ F.T
    for i, pose in enumerate(poses):
        block = slice(3 * i, 3 * i + 3)
        S[block, block] += p.holders.triad_offset_sd_mm**2 * np.eye(3) + pose.covariance[:3, :3]
    chi2 = float(residual @ np.linalg.solve(S, residual))
    distance = float(np.sqrt((residual**2).sum() / k))
    return _Misfit(0.5 * chi2 + 0.5 * float(np.linalg.slogdet(S)[1]), chi2, distance)


def _interpolation(numbers: Float, at: Float) -> Float:
    """Return weights (k, n) of vertebrae at increasing numbers (n,) for numbers (k,), linear beyond the ends."""
    upper = np.clip(np.searchsorted(numbers, at, side="right") - 1, 0, len(numbers) - 2)
    share = (at - numbers[upper]) / (numbers[upper + 1] - numbers[upper])
    weight = np.zeros((len(at), len(numbers)))
    row = np.arange(len(at))
    weight[row, upper], weight[row, upper + 1] = 1 - share, share
    return weight


def _times(ratio: float) -> str:
    return "over a million" if ratio > 1e6 else f"{ratio:.0f}"


def _text(shift: int) -> str:
    levels = "level" if abs(shift) == 1 else "levels"
    return f"{abs(shift)} {levels} {'caudal' if shift > 0 else 'cranial'}"
