"""Orientations between known vertebrae: a C2 rotation spline of the change, and others that bracket it."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation, RotationSpline

from spinewatch.arrays import Float, Int
from spinewatch.geometry.rotations import rotation_from_vector
from spinewatch.geometry.splines import linear_weights, natural_spline_weights, secant_spline_weights
from spinewatch.spine.configuration import SpinePoses
from spinewatch.spine.displacements import Base, add_source, is_known, knots_and_between, spread_errors
from spinewatch.spine.interpolation_model import (
    InterpolationParameters,
    interpolation_error,
    rotation_amplitude,
)

_ROTATION = slice(3, 6)


def fill_rotations(
    rotation: Float, errors: dict[str, Float], base: Base, source: str, parameters: InterpolationParameters
) -> Float:
    """Return rotations with those between known ones filled in, and add their errors.

    Parameters
    ----------
    rotation
        Rotations, shape (n, 3, 3); NaN where unknown.
    errors
        Errors of the poses by source, (n, 6, r) each; the rows of filled rotations are written.
    base
        What changes are counted from.
    source
        Name of the source of the interpolation's own error.
    parameters
        How large that is.

    Returns
    -------
    Float
        Rotations, shape (n, 3, 3): the rotation spline of the changes, applied to the base.

    References
    ----------
    `scipy.spatial.transform.RotationSpline`. Errors of the knots spread with the weights of the spline of small
    rotations, each turned by half the rotation from its knot; for slerp that is exact to first order in the rotation
    between the knots.
    """
    known, before, places = is_known(rotation), base.poses.rotation, base.places
    knots, at = knots_and_between(known, is_known(before))
    filled = rotation.copy()
    if not len(at):
        return filled
    change = rotation[knots] @ np.swapaxes(before[knots], -1, -2)
    turn = np.zeros_like(rotation)
    turn[knots] = change
    turn[at] = RotationSpline(places[knots], Rotation.from_matrix(change))(places[at]).as_matrix()
    filled[at] = turn[at] @ before[at]
    W = secant_spline_weights(places[knots], places[at])
    between = turn[at][:, None] @ np.swapaxes(change, -1, -2)
    half = rotation_from_vector(_vectors(between) / 2)
    spread_errors(errors, base.errors, knots, at, W[..., None, None] * half, _ROTATION, turn)
    angles = np.degrees(_vectors(change @ change[0].T))
    own = interpolation_error(
        places,
        knots,
        at,
        W,
        amplitude=rotation_amplitude(angles, parameters),
        irregularity=parameters.rotation_irregularity_deg,
        correlation_levels=parameters.correlation_levels,
    )
    add_source(errors, source, len(known), at, _ROTATION, own)
    return filled


def other_interpolations(measured: SpinePoses, filled: SpinePoses, base: Base) -> tuple[SpinePoses, ...]:
    """Return other interpolations of the same poses, which bracket those in between.

    Parameters
    ----------
    measured
        Poses of the known vertebrae; NaN for the others.
    filled
        The same with those in between.
    base
        What changes are counted from.

    Returns
    -------
    tuple of SpinePoses
        Straight lines and slerp of the absolute poses; the same of the change; the splines of the absolute poses. Empty
        if nothing is in between.
    """
    knots, at = knots_and_between(is_known(measured.rotation), is_known(filled.rotation))
    if not len(at):
        return ()
    t, s = base.places[knots], base.places[at]
    W = linear_weights(t, s)
    R, p = measured.rotation[knots], measured.position_mm[knots]
    change = R @ np.swapaxes(base.poses.rotation[knots], -1, -2)
    before = base.poses.position_mm
    moved = before[at] + W @ (p - before[knots])
    return (
        _replaced(filled, at, W @ p, _slerp(t, R, s)),
        _replaced(filled, at, moved, _slerp(t, change, s) @ base.poses.rotation[at]),
        _replaced(
            filled,
            at,
            natural_spline_weights(t, s) @ p,
            RotationSpline(t, Rotation.from_matrix(R))(s).as_matrix(),
        ),
    )


def _replaced(poses: SpinePoses, at: Int, position: Float, rotation: Float) -> SpinePoses:
    """Return poses with some of them replaced."""
    positions, rotations = poses.position_mm.copy(), poses.rotation.copy()
    positions[at], rotations[at] = position, rotation
    return SpinePoses(positions, rotations)


def _slerp(knots: Float, R: Float, at: Float) -> Float:
    """Return rotations between those at the knots, each at constant speed."""
    i = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, len(knots) - 2)
    share = (at - knots[i]) / (knots[i + 1] - knots[i])
    step = _vectors(R[1:] @ np.swapaxes(R[:-1], -1, -2))
    return rotation_from_vector(share[:, None] * step[i]) @ R[i]


def _vectors(R: Float) -> Float:
    """Return rotation vectors (..., 3), radians, of rotations (..., 3, 3)."""
    return np.asarray(Rotation.from_matrix(R.reshape(-1, 3, 3)).as_rotvec().reshape(R.shape[:-1]))
