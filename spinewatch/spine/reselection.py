"""The most tilted vertebrae of a stage: end vertebrae of the re-selected Cobb angle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import erf

import numpy as np

from spinewatch.arrays import Float
from spinewatch.spine.configuration import SpineConfiguration
from spinewatch.spine.curves import coronal_tilts, measured_span
from spinewatch.spine.evaluation import missing_reason
from spinewatch.spine.measure_parameters import MeasureParameters
from spinewatch.spine.results import Curve
from spinewatch.spine.smoothing import smoothed


@dataclass(frozen=True)
class ReselectionWindow:
    """The vertebrae that the end vertebrae of a curve are selected from.

    Attributes
    ----------
    upper, lower
        Names of the candidates, cranial first: from the apex of the curve above to the own apex, and from there to the
        apex of the curve below; the ends of the measured span where there is no such curve.
    sign
        1 for a curve convex to the right, -1 to the left.
    """

    upper: tuple[str, ...]
    lower: tuple[str, ...]
    sign: float


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
    bounds = [0, *(span.index(curve.apex) for curve in curves), len(span) - 1]
    return tuple(
        ReselectionWindow(
            tuple(span[above : apex + 1]),
            tuple(span[apex : below + 1]),
            1.0 if curve.side == "right" else -1.0,
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
    """

    upper: str
    lower: str
    rivals: tuple[str, ...]
    excess_deg: float
    selection_sd_deg: float


def reselected_ends(
    configuration: SpineConfiguration,
    factor: Float,
    bracketed: frozenset[str],
    window: ReselectionWindow,
    parameters: MeasureParameters,
) -> ReselectedEnds | None:
    """Return the most tilted vertebrae of a curve at a stage.

    The most tilted of several vertebrae with errors is tilted too much. So the end vertebrae are the extremes of the
    smoothed tilts less their deviations, which hardly depend on the errors of their own and prefer vertebrae with a
    marker; the angle between them is that of their measured tilts.

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
    upper, lower = ([name for name in names if name not in absent] for names in (window.upper, window.lower))
    if not upper or not lower:
        return None
    levels = np.array(sorted({configuration.index(name) for name in (*upper, *lower)}), dtype=np.intp)
    tilts, errors = coronal_tilts(configuration, factor, levels)
    smooth, covariance = smoothed(tilts, errors @ errors.T, parameters.tilt_roughness_deg)
    doubt = parameters.reselection_deviations * np.sqrt(np.maximum(np.diag(covariance), 0.0))
    place = {configuration.levels[i]: k for k, i in enumerate(levels)}
    chosen, rivals, excess, losses = [], [], 0.0, []
    for names, sign in ((upper, -window.sign), (lower, window.sign)):
        rows = np.array([place[name] for name in names])
        signed = sign * smooth[rows]
        first = int(np.argmax(signed - doubt[rows]))
        chosen.append(names[first])
        more = {
            name: float(signed[k] + doubt[rows][k] - signed[first])
            for k, name in enumerate(names)
            if name in bracketed and k != first
        }
        rivals += [name for name, difference in more.items() if difference > 0]
        excess += max([0.0, *more.values()])
        S = covariance[np.ix_(rows, rows)]
        variance = np.diag(S) + S[first, first] - 2 * S[first]
        loss = _expected_excess(signed - signed[first], np.sqrt(np.maximum(variance, 0.0)))
        losses.append(max(loss[k] for k, name in enumerate(names) if k == first or name not in bracketed))
    return ReselectedEnds(
        chosen[0],
        chosen[1],
        tuple(dict.fromkeys(rivals)),
        window.sign * excess,
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
