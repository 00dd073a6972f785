"""Curves of a spine in the coronal plane: end vertebrae and apices, robust against the errors of the tilts."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from spinewatch.arrays import Float, Int
from spinewatch.spine.configuration import SpineConfiguration
from spinewatch.spine.measure_functions import cobb_angle
from spinewatch.spine.measure_parameters import MeasureParameters
from spinewatch.spine.orientation import tilt_gradients, tilts_of
from spinewatch.spine.results import Curve
from spinewatch.spine.smoothing import smoothed
from spinewatch.spine.uncertainty import common_factors, normal_interval


def measured_span(configuration: SpineConfiguration) -> Int:
    """Return the vertebrae between which curves are looked for.

    Parameters
    ----------
    configuration
        The spine at the baseline stage.

    Returns
    -------
    Int
        Indices of the vertebrae from the most cranial marker to the most caudal one, as far as they have a pose. If
        fewer than two carry a marker, all with a pose: what no marker bounds can be measured at the baseline only.
    """
    unknown = np.isnan(configuration.poses.position_mm).any(axis=-1)
    unknown |= np.isnan(configuration.poses.rotation).any(axis=(-2, -1))
    posed = np.logical_not(unknown)
    marked = np.flatnonzero(np.array(configuration.marked) & posed)
    if len(marked) >= 2:
        posed[: marked[0]] = False
        posed[marked[-1] + 1 :] = False
    return np.flatnonzero(posed)


def coronal_tilts(configuration: SpineConfiguration, factor: Float, levels: Int) -> tuple[Float, Float]:
    """Return coronal tilts and their errors.

    Parameters
    ----------
    configuration
        The spine at a stage.
    factor
        Its error factors side by side, shape (n, 6, r), as of `uncertainty.common_factors`.
    levels
        Indices of the vertebrae, shape (m,).

    Returns
    -------
    tilts : Float
        Shape (m,), degrees.
    errors : Float
        Error of each tilt per unit error of each source, shape (m, r), degrees.
    """
    rotation = configuration.poses.rotation[levels]
    gradients = tilt_gradients(rotation)[:, 0]
    return tilts_of(rotation)[0], np.einsum("ma,mar->mr", gradients, factor[levels, 3:])


def find_curves(
    configuration: SpineConfiguration, parameters: MeasureParameters | None = None
) -> tuple[Curve, ...]:
    """Return the curves of a spine in the coronal plane.

    End vertebrae are the extremes of the coronal tilt along the spine. From all turning points of the tilt, smoothed as
    far as its errors require, the smallest swing is removed until every swing left is a curve. The apex is the vertebra
    farthest to the convex side from the line between the end vertebrae. Which vertebrae are chosen hardly depends on
    the errors of their own tilts, so that the Cobb angle between them is not exaggerated. A curve whose end vertebrae
    are neighbours has its apex at their disc.

    Parameters
    ----------
    configuration
        The spine at the baseline stage.
    parameters
        Limits; None for the defaults.

    Returns
    -------
    tuple of Curve
        The curves, cranial first; only the largest one if none is large enough; empty if fewer than three vertebrae
        have a pose.

    References
    ----------
    Scoliosis Research Society, Revised Glossary of Terms (2000): end vertebrae as the most tilted ones, the apex a
    vertebra or a disc, curves from 10 degrees. Removal of the smallest swing: four-point counting of turning points,
    ASTM E1049 section 5.4.4.
    """
    parameters = parameters or MeasureParameters()
    span = measured_span(configuration)
    if len(span) < 3:
        return ()
    (factor,) = common_factors((configuration,))
    tilts, errors = coronal_tilts(configuration, factor, span)
    tilts, covariance = smoothed(tilts, errors @ errors.T, parameters.tilt_roughness_deg)
    ends = _swings(tilts, covariance, parameters)
    return tuple(
        _curve(configuration, factor, span, (upper, lower), f"curve {number}", parameters)
        for number, (upper, lower) in enumerate(pairwise(ends), start=1)
    )


def _swings(tilts: Float, covariance: Float, parameters: MeasureParameters) -> list[int]:
    """Return the turning points of tilts between which each swing is a curve, or the largest swing."""
    turns = _turning_points(tilts)
    while len(turns) > 2:
        upper, lower = np.array(turns[:-1]), np.array(turns[1:])
        size = np.abs(tilts[lower] - tilts[upper])
        variance = covariance[lower, lower] + covariance[upper, upper] - 2 * covariance[lower, upper]
        sd = np.sqrt(np.maximum(variance, 0.0))
        small = size < np.maximum(parameters.min_cobb_deg, parameters.min_cobb_deviations * sd)
        if not small.any():
            break
        k = int(np.argmin(np.where(small, size, np.inf)))
        if k == 0:
            del turns[0]
        elif k == len(size) - 1:
            del turns[-1]
        else:
            del turns[k : k + 2]
    return turns


def _turning_points(tilts: Float) -> list[int]:
    """Return the first place of tilts, those where they turn, and the last; of equal ones the most caudal."""
    steps = np.diff(tilts)
    moves = np.flatnonzero(steps)
    turns = [int(after) for before, after in pairwise(moves) if steps[before] * steps[after] < 0]
    return [0, *turns, len(tilts) - 1]


def _curve(
    configuration: SpineConfiguration,
    factor: Float,
    span: Int,
    ends: tuple[int, int],
    name: str,
    parameters: MeasureParameters,
) -> Curve:
    """Return the curve between two places of the span."""
    names = [configuration.levels[i] for i in span]
    upper, lower = ends
    side = _side(configuration, factor, span[upper], span[lower])
    return Curve(
        name=name,
        upper=names[upper],
        apex=_apex(configuration, factor, span, ends, side, parameters),
        lower=names[lower],
        side=side,
        open_ends=tuple(names[end] for end in ends if end in (0, len(names) - 1)),
    )


def _side(configuration: SpineConfiguration, factor: Float, upper: int, lower: int) -> str | None:
    """Return the side of the convexity between two vertebrae, None if the interval of their Cobb angle holds zero."""
    _, errors = coronal_tilts(configuration, factor, np.array([upper, lower]))
    by_interpolation = [
        cobb_angle(poses.rotation[upper], poses.rotation[lower])
        for poses in (configuration.poses, *configuration.alternatives)
    ]
    known = np.array([value for value in by_interpolation if not np.isnan(value)])
    least, most = normal_interval(known, float(np.linalg.norm(errors[1] - errors[0])))
    if least <= 0.0 <= most:
        return None
    return "right" if least > 0 else "left"


def _apex(
    configuration: SpineConfiguration,
    factor: Float,
    span: Int,
    ends: tuple[int, int],
    side: str | None,
    parameters: MeasureParameters,
) -> str | None:
    """Return the vertebra between two places of the span that is farthest to a side, or to either if None is known."""
    upper, lower = ends
    if lower - upper == 1:
        return None
    c = configuration.poses.position_mm[span].copy()
    y_errors = factor[span, 1]
    c[:, 1] = smoothed(c[:, 1], y_errors @ y_errors.T, parameters.offset_roughness_mm)[0]
    chord = c[lower] - c[upper]
    arm = c[upper + 1 : lower] - c[upper]
    to_the_left = arm[:, 1] - arm @ chord / (chord @ chord) * chord[1]
    offset = {"right": -to_the_left, "left": to_the_left, None: np.abs(to_the_left)}[side]
    return configuration.levels[int(span[upper + 1 + int(np.argmax(offset))])]
