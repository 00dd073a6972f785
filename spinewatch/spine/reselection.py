"""The most tilted vertebrae of a stage: end vertebrae of the re-selected Cobb angle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import erf

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.spine.configuration import SpineConfiguration
from spinewatch.spine.curves import coronal_tilts, measured_span
from spinewatch.spine.evaluation import missing_reason
from spinewatch.spine.measure_parameters import MeasureParameters
from spinewatch.spine.results import Curve
from spinewatch.spine.smoothing import smoothed
from spinewatch.spine.uncertainty import QUANTILE_95


@dataclass(frozen=True)
class ReselectionWindow:
    """The vertebrae that the end vertebrae of a curve are selected from.

    Attributes
    ----------
    upper, lower
        Names of the candidates, cranial first: those above and those below the apex, up to the apex of the curve above
        and down to the apex of the curve below; to the ends of the measured span where there is no such curve.
    ends
        End vertebrae at the baseline. The curve is convex to the side that it is convex to between them.
    """

    upper: tuple[str, ...]
    lower: tuple[str, ...]
    ends: tuple[str, str]


def reselection_windows(
    baseline: SpineConfiguration, curves: Sequence[Curve]
) -> tuple[ReselectionWindow, ...]:
    """Return the candidates for the end vertebrae of each curve.

    Parameters
    ----------
    baseline
        The spine at the baseline stage.
    curves
        Its curves, cranial first.

    Returns
    -------
    tuple of ReselectionWindow
        One per curve.
    """
    span = [baseline.levels[i] for i in measured_span(baseline)]
    apices = [
        span.index(curve.upper) + 0.5 if curve.apex is None else span.index(curve.apex) for curve in curves
    ]
    bounds = [0, *apices, len(span) - 1]
    return tuple(
        ReselectionWindow(
            tuple(name for i, name in enumerate(span) if above <= i < apex),
            tuple(name for i, name in enumerate(span) if apex < i <= below),
            (curve.upper, curve.lower),
        )
        for curve, above, apex, below in zip(curves, bounds, bounds[1:], bounds[2:], strict=False)
    )


@dataclass(frozen=True)
class ReselectedEnds:
    """The most tilted vertebrae of a curve at a stage.

    Attributes
    ----------
    upper, lower
        Names of the end vertebrae.
    rivals
        Interpolated vertebrae that may be tilted more.
    excess_deg
        By how much the Cobb angle between them may be larger, degrees, with the sign of the curve.
    selection_sd_deg
        How much is to be expected to be lost because the most tilted vertebrae are others, beside the rivals, degrees.
    opposite
        The end vertebrae if the curve is convex to the other side; None where its side is known, and if they are the
        same.
    """

    upper: str
    lower: str
    rivals: tuple[str, ...]
    excess_deg: float
    selection_sd_deg: float
    opposite: tuple[str, str] | None = None


def reselected_ends(
    configuration: SpineConfiguration,
    factor: Float,
    bracketed: frozenset[str],
    window: ReselectionWindow,
    parameters: MeasureParameters,
) -> ReselectedEnds | None:
    """Return the most tilted vertebrae of a curve at a stage.

    The curve is convex to the side that the smoothed tilts of its end vertebrae of the baseline say, or of the nearest
    candidates with a pose: a curve that went past zero is convex to the other side. The most tilted of several
    vertebrae with errors is tilted too much. So the end vertebrae are the extremes of the smoothed tilts less their
    deviations, which hardly depend on the errors of their own and prefer vertebrae with a marker; the angle between
    them is that of their measured tilts.

    Parameters
    ----------
    configuration
        The spine at the stage.
    factor
        Its error factors side by side, shape (n, 6, r), as of `uncertainty.common_factors`.
    bracketed
        Vertebrae that are only bracketed, as of `evaluation.bracketed_levels`.
    window
        The candidates.
    parameters
        Roughness of the tilts; deviations by which an end vertebra must exceed the others.

    Returns
    -------
    ReselectedEnds or None
        The end vertebrae; None if the candidates for one of them have no pose.
    """
    absent = candidates_without_pose(configuration, window)
    candidates = [
        [configuration.index(name) for name in names if name not in absent]
        for names in (window.upper, window.lower)
    ]
    if not all(candidates):
        return None
    levels = np.arange(candidates[0][0], candidates[1][-1] + 1)
    levels = levels[~np.isnan(configuration.poses.rotation[levels]).any(axis=(1, 2))]
    tilts, errors = coronal_tilts(configuration, factor, levels)
    smooth, covariance = smoothed(tilts, errors @ errors.T, parameters.tilt_roughness_deg)
    rows = [np.searchsorted(levels, indices) for indices in candidates]
    names = [configuration.levels[i] for i in levels]
    ends = [
        indices[int(np.argmin(np.abs(np.array(indices) - configuration.index(end))))]
        for indices, end in zip(candidates, window.ends, strict=True)
    ]
    upper, lower = np.searchsorted(levels, ends)
    swing = float(smooth[lower] - smooth[upper])
    variance = covariance[lower, lower] + covariance[upper, upper] - 2 * covariance[lower, upper]
    sign = 1.0 if swing >= 0 else -1.0
    found = _most_tilted(smooth, covariance, rows, names, sign, bracketed, parameters)
    if abs(swing) > QUANTILE_95 * np.sqrt(max(variance, 0.0)):
        return found
    other = _most_tilted(smooth, covariance, rows, names, -sign, bracketed, parameters)
    opposite = (other.upper, other.lower)
    return found if opposite == (found.upper, found.lower) else replace(found, opposite=opposite)


def _most_tilted(
    smooth: Float,
    covariance: Float,
    candidates: Sequence[Int],
    names: Sequence[str],
    sign: float,
    bracketed: frozenset[str],
    parameters: MeasureParameters,
) -> ReselectedEnds:
    """Return the end vertebrae of a curve that is convex to the right (``sign`` 1) or to the left (-1).

    ``candidates`` are the places of those for the upper and for the lower one among the smoothed tilts and ``names``.
    """
    doubt = parameters.reselection_deviations * np.sqrt(np.maximum(np.diag(covariance), 0.0))
    chosen, rivals, excess, losses = [], [], 0.0, []
    for rows, direction in zip(candidates, (-sign, sign), strict=True):
        signed = direction * smooth[rows]
        first = int(np.argmax(signed - doubt[rows]))
        chosen.append(names[rows[first]])
        more = {
            names[row]: float(signed[k] + doubt[row] - signed[first])
            for k, row in enumerate(rows)
            if names[row] in bracketed and k != first
        }
        rivals += [name for name, difference in more.items() if difference > 0]
        excess += max([0.0, *more.values()])
        S = covariance[np.ix_(rows, rows)]
        variance = np.diag(S) + S[first, first] - 2 * S[first]
        loss = _expected_excess(signed - signed[first], np.sqrt(np.maximum(variance, 0.0)))
        losses.append(max(loss[k] for k, row in enumerate(rows) if k == first or names[row] not in bracketed))
    return ReselectedEnds(
        chosen[0],
        chosen[1],
        tuple(dict.fromkeys(rivals)),
        sign * excess,
        float(np.hypot(losses[0], losses[1])),
    )


def _expected_excess(mean: Float, sd: Float) -> Float:
    """Return the means of the positive parts of normal variables (n,)."""
    found = np.maximum(mean, 0.0)
    for k in np.flatnonzero(sd):
        ratio = mean[k] / sd[k]
        density = np.exp(-(ratio**2) / 2) / np.sqrt(2 * np.pi)
        found[k] = sd[k] * density + mean[k] * (1 + erf(ratio / np.sqrt(2))) / 2
    return np.asarray(found)


def candidates_without_pose(configuration: SpineConfiguration, window: ReselectionWindow) -> tuple[str, ...]:
    """Return the candidates for the end vertebrae of a curve that have no pose at a stage.

    Parameters
    ----------
    configuration
        The spine at the stage.
    window
        The candidates.

    Returns
    -------
    tuple of str
        Their names, cranial first.
    """
    names = dict.fromkeys((*window.upper, *window.lower))
    return tuple(
        name for name in names if missing_reason(configuration, (name,), positions=False) is not None
    )
