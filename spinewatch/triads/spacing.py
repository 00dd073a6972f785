"""The distances between labelled triads compared with the levels between their vertebrae."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.levels import anatomical_sequence


@dataclass(frozen=True)
class SpacingParameters:
    """Distances between the triads of neighbouring vertebrae.

    Attributes
    ----------
    cervical_mm, thoracic_mm, lumbar_mm
        Least and largest distance from a vertebra of the region to the next one below it, mm.
    level_mm
        Median distance over the spine of a patient, mm.
    level_sd
        Relative standard deviation of that distance between patients.
    trend
        Relative increase of the distance from each level to the one below.
    trend_sd
        Standard deviation of the increase between patients.
    gap_sd
        Relative standard deviation of one distance: vertebrae differ, and markers lean.
    min_likelihood_ratio
        How many times more likely other vertebrae must make the distances than those that were named.
    max_shift
        Largest number of levels by which other vertebrae are tried.
    """

    cervical_mm: tuple[float, float] = (10.0, 30.0)
    thoracic_mm: tuple[float, float] = (12.0, 45.0)
    lumbar_mm: tuple[float, float] = (15.0, 50.0)
    level_mm: float = 26.0
    level_sd: float = 0.25
    trend: float = 0.02
    trend_sd: float = 0.02
    gap_sd: float = 0.12
    min_likelihood_ratio: float = 100.0
    max_shift: int = 4


def implausible_spacing(
    positions_mm: Float, numbers: Int, extra_levels: Sequence[str], parameters: SpacingParameters
) -> str | None:
    """Return what contradicts the vertebrae named for triads in the distances between the triads.

    A distance per level outside the limits contradicts them. So do distances that other vertebrae, with one name or one
    part of the chain shifted, make more likely by `SpacingParameters.min_likelihood_ratio`.

    Parameters
    ----------
    positions_mm
        Positions of the triads in order along the spine, at least two, shape (n, 3), mm.
    numbers
        Places of their vertebrae in the anatomical sequence, increasing or decreasing, shape (n,).
    extra_levels
        Vertebrae that this spine has in addition.
    parameters
        Limits and variation of the distances.

    Returns
    -------
    str or None
        Sentence with the distances; None if nothing contradicts the names.

    Notes
    -----
    The logarithms of the distances per level are normal with a common mean, a linear trend along the spine and
    independent errors; mean and trend have normal priors. Names that are all shifted by the same number of levels, and
    the reverse order, have almost the same likelihood and are not detected.

    Examples
    --------
    >>> positions = np.array([[0.0, 0, 0], [50, 0, 0], [105, 0, 0]])
    >>> implausible_spacing(positions, np.array([19, 17, 15]), (), SpacingParameters())
    >>> implausible_spacing(positions, np.array([22, 17, 15]), (), SpacingParameters())
    'L4 and T11 are 50 mm apart, 10.0 mm per level instead of 14 to 48'
    """
    p = parameters
    sequence = anatomical_sequence(extra_levels)
    gaps = np.linalg.norm(np.diff(positions_mm, axis=0), axis=1)
    limits = _limits_mm(numbers, sequence, p)
    steps = np.abs(np.diff(numbers))
    outside = [
        f"{sequence[numbers[i]]} and {sequence[numbers[i + 1]]} are {gaps[i]:.0f} mm apart, {gaps[i] / steps[i]:.1f} mm"
        f" per level instead of {limits[i, 0] / steps[i]:.0f} to {limits[i, 1] / steps[i]:.0f}"
        for i in np.flatnonzero((gaps < limits[:, 0]) | (gaps > limits[:, 1]))
    ]
    if outside:
        return "; ".join(outside)
    others = _other_numbers(numbers, len(sequence), p.max_shift)
    if not len(others):
        return None
    likelihood = _likelihood(gaps, others, p)
    best = int(np.argmax(likelihood))
    ratio = float(np.exp(min(likelihood[best] - _likelihood(gaps, numbers, p), 50.0)))
    if ratio < p.min_likelihood_ratio:
        return None
    return (
        f"the distances fit {_names(others[best], sequence)} {ratio:.3g} times better"
        f" ({_per_level(gaps, others[best])} mm per level) than {_names(numbers, sequence)}"
        f" ({_per_level(gaps, numbers)} mm per level)"
    )


def _limits_mm(numbers: Int, sequence: Sequence[str], p: SpacingParameters) -> Float:
    """Return the least and the largest distance between neighbouring triads, shape (n - 1, 2), mm."""
    of_region = {"C": p.cervical_mm, "T": p.thoracic_mm, "L": p.lumbar_mm, "S": p.lumbar_mm}
    each = np.array([of_region[name[0]] for name in sequence])
    above = np.vstack([np.zeros(2), np.cumsum(each, axis=0)])[numbers]
    return np.asarray(np.abs(np.diff(above, axis=0)))


def _other_numbers(numbers: Int, count: int, max_shift: int) -> Int:
    """Return places (m, n) with one vertebra, or all from one on, shifted by up to some levels in the same order."""
    n = len(numbers)
    shifted = np.stack([np.eye(n, dtype=np.intp), np.triu(np.ones((n, n), dtype=np.intp))], axis=1)
    shifts = np.delete(np.arange(-max_shift, max_shift + 1), max_shift)
    subsets = shifted.reshape(-1, n)[:-1]  # for the last vertebra, both are the same
    others = (numbers + subsets[:, None] * shifts[:, None]).reshape(-1, n)
    same_order = np.all(np.sign(np.diff(others)) == np.sign(np.diff(numbers)), axis=1)
    possible = same_order & np.all((others >= 0) & (others < count), axis=1)
    return np.asarray(others[possible])


def _likelihood(gaps_mm: Float, numbers: Int, p: SpacingParameters) -> Float:
    """Return log-likelihoods (...), without their constant, of distances (n - 1,) between vertebrae (..., n)."""
    middle = (numbers[..., :-1] + numbers[..., 1:]) / 2
    x = middle - middle.mean(axis=-1, keepdims=True)
    residual = np.log(gaps_mm / np.abs(np.diff(numbers))) - np.log(p.level_mm) - p.trend * x
    covariance = p.gap_sd**2 * np.eye(x.shape[-1]) + p.level_sd**2
    covariance = covariance + p.trend_sd**2 * x[..., :, None] * x[..., None, :]
    chi2 = (residual * np.linalg.solve(covariance, residual[..., None])[..., 0]).sum(axis=-1)
    return np.asarray(-0.5 * (chi2 + np.linalg.slogdet(covariance)[1]))


def _names(numbers: Int, sequence: Sequence[str]) -> str:
    """Return the names of vertebrae."""
    return ",".join(sequence[number] for number in numbers)


def _per_level(gaps_mm: Float, numbers: Int) -> str:
    """Return distances divided by levels, as text."""
    return ", ".join(f"{value:.1f}" for value in gaps_mm / np.abs(np.diff(numbers)))
