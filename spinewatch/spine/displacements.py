"""Bodies between known ones: places along the spine, and positions by a C2 spline of displacements; NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spinewatch.arrays import Bool, Float, Int
from spinewatch.errors import ParameterError
from spinewatch.geometry.splines import linear_weights, natural_spline_weights
from spinewatch.spine.configuration import ErrorFactors, SpinePoses
from spinewatch.spine.interpolation_model import (
    InterpolationParameters,
    interpolation_error,
    position_amplitude,
)

_POSITION = slice(0, 3)


class BodiesCoincideError(ParameterError):
    """Two bodies of the initial configuration have the same position."""

    code = "bodies-coincide"


def interpolation_source(stage: str) -> str:
    """Return the name of the source of the errors of interpolation at a stage.

    Parameters
    ----------
    stage
        Name of the stage.

    Returns
    -------
    str
        ``interpolation NAME``.
    """
    return f"interpolation {stage}"


def is_known(values: Float) -> Bool:
    """Return which vertebrae have values.

    Parameters
    ----------
    values
        Positions (n, 3) or rotations (n, 3, 3); NaN where unknown.

    Returns
    -------
    Bool
        Shape (n,).
    """
    return np.asarray(np.isfinite(values.reshape(len(values), -1)).all(axis=1))


def spine_places(position_mm: Float) -> Float:
    """Return the places of vertebrae along the spine, in levels.

    Parameters
    ----------
    position_mm
        Centroids from cranial to caudal, shape (n, 3), mm; NaN where unknown.

    Returns
    -------
    Float
        Length of the polyline through the centroids from the first known one, divided by its mean length per level,
        shape (n,). Vertebrae without a centroid share the length between their neighbours; beyond the known ones NaN.

    Raises
    ------
    BodiesCoincideError
        If two neighbouring centroids coincide.
    """
    known = np.flatnonzero(is_known(position_mm))
    places = np.full(len(position_mm), np.nan)
    chords = np.linalg.norm(np.diff(position_mm[known], axis=0), axis=1)
    if not (chords > 0).all():
        raise BodiesCoincideError("two bodies of the initial configuration coincide; correct their positions")
    length = np.concatenate([[0.0], np.cumsum(chords)])
    inside = np.arange(known[0], known[-1] + 1)
    levels = max(len(inside) - 1, 1)
    places[inside] = (
        linear_weights(known.astype(float), inside.astype(float)) @ length if len(known) > 1 else 0.0
    )
    return np.asarray(places / (length[-1] / levels if length[-1] > 0 else 1.0))


def knots_and_between(known: Bool, possible: Bool) -> tuple[Int, Int]:
    """Return the vertebrae that interpolation starts from, and those that it can place.

    Parameters
    ----------
    known
        Which vertebrae have a pose, shape (n,).
    possible
        Which ones may be interpolated, shape (n,).

    Returns
    -------
    knots
        Indices of the known ones; none if there are fewer than two.
    between
        Indices of the possible ones between the first and the last known one.
    """
    knots = np.flatnonzero(known)
    if len(knots) < 2:
        return np.zeros(0, dtype=np.intp), np.zeros(0, dtype=np.intp)
    inside = np.arange(len(known))
    between = np.flatnonzero(possible & ~known & (inside > knots[0]) & (inside < knots[-1]))
    return knots, between


@dataclass(frozen=True, eq=False)
class Base:
    """What changes along the spine are counted from.

    Attributes
    ----------
    poses
        Poses of the n vertebrae, patient axes; NaN where a vertebra cannot be placed. Zeros and identities make the
        absolute poses the changes.
    errors
        Their errors by source.
    places
        Places along the spine, shape (n,), levels.
    """

    poses: SpinePoses
    errors: ErrorFactors
    places: Float


def fill_positions(
    position_mm: Float, errors: dict[str, Float], base: Base, source: str, parameters: InterpolationParameters
) -> Float:
    """Return positions with those between known ones filled in, and add their errors.

    Parameters
    ----------
    position_mm
        Positions, shape (n, 3), mm; NaN where unknown.
    errors
        Errors of the poses by source, (n, 6, r) each; the rows of filled positions are written.
    base
        What displacements are counted from.
    source
        Name of the source of the interpolation's own error.
    parameters
        How large that is.

    Returns
    -------
    Float
        Positions, shape (n, 3), mm: base plus the natural cubic spline of the displacements of the known ones.

    References
    ----------
    That errors of the base positions move the places along the spine a little is neglected.
    """
    known, base_mm, places = is_known(position_mm), base.poses.position_mm, base.places
    knots, at = knots_and_between(known, is_known(base_mm))
    filled = position_mm.copy()
    if not len(at):
        return filled
    W = natural_spline_weights(places[knots], places[at])
    displacement = position_mm[knots] - base_mm[knots]
    filled[at] = base_mm[at] + W @ displacement
    identity = np.broadcast_to(np.eye(3), (len(known), 3, 3))
    spread_errors(errors, base.errors, knots, at, W[..., None, None] * np.eye(3), _POSITION, identity)
    own = interpolation_error(
        places,
        knots,
        at,
        W,
        amplitude=position_amplitude(displacement, places[knots], parameters),
        irregularity=parameters.position_irregularity_mm,
        correlation_levels=parameters.correlation_levels,
    )
    add_source(errors, source, len(known), at, _POSITION, own)
    return filled


def spread_errors(
    errors: dict[str, Float],
    base_errors: ErrorFactors,
    knots: Int,
    at: Int,
    weights: Float,
    rows: slice,
    turn: Float,
) -> None:
    """Write the errors of interpolated vertebrae, which follow from those of the knots and of the base.

    Parameters
    ----------
    errors
        Errors of the poses by source, (n, 6, r) each; written.
    base_errors
        Errors of the base poses by source, (n, 6, r) each.
    knots, at
        Indices of the m knots and of the q interpolated vertebrae.
    weights
        Weights of the errors of the knots, shape (q, m, 3, 3).
    rows
        Rows of the errors that are interpolated: the positions or the rotations.
    turn
        Rotations of the motion since the base, shape (n, 3, 3), which turn the base's errors.
    """
    q, m = len(at), len(knots)
    W = weights.transpose(0, 2, 1, 3).reshape(3 * q, 3 * m)
    for source in dict.fromkeys([*errors, *base_errors]):
        like = errors[source] if source in errors else base_errors[source]
        F, base = errors.setdefault(source, np.zeros_like(like)), base_errors.get(source, np.zeros_like(like))
        moved = F[knots, rows] - turn[knots] @ base[knots, rows]
        F[at, rows] = (W @ moved.reshape(3 * m, -1)).reshape(q, 3, -1) + turn[at] @ base[at, rows]


def add_source(errors: dict[str, Float], source: str, n: int, at: Int, rows: slice, own: Float) -> None:
    """Add columns to a source of errors.

    Parameters
    ----------
    errors
        Errors by source, (n, 6, r) each; the source is written.
    source
        Its name.
    n
        Number of vertebrae.
    at
        Indices of the q vertebrae with these errors.
    rows
        Rows of the errors: the positions or the rotations.
    own
        The errors, shape (q, 3, r).
    """
    columns = np.zeros((n, 6, own.shape[2]))
    columns[at, rows] = own
    former = errors.get(source)
    errors[source] = columns if former is None else np.concatenate([former, columns], axis=2)
