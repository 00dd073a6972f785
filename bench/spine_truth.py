"""True values of the measures of a simulated spine, by formulas that are written here once more."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np

from spinewatch.arrays import Float
from spinewatch.simulation.scoliosis import LEVELS
from spinewatch.spine.configuration import SpinePoses
from spinewatch.spine.results import Curve

CIRCULAR = "plane-of-maximum-curvature"
"""The only measure whose errors are to be taken as angles on a circle."""


def true_value(definition: str, levels: Sequence[str], poses: SpinePoses) -> float:
    """Return the true value of a measure between levels, cranial first, of a spine with all ``LEVELS``."""
    rows = [LEVELS.index(level) for level in levels]
    c, R = poses.position_mm[rows], poses.rotation[rows]
    z = R[:, :, 2]
    coronal = np.degrees(np.arctan2(-z[:, 1], z[:, 2]))
    sagittal = np.degrees(np.arctan2(z[:, 0], z[:, 2]))
    values: dict[str, Callable[[], float]] = {
        "cobb-fixed": lambda: coronal[-1] - coronal[0],
        "kyphosis": lambda: sagittal[0] - sagittal[-1],
        "lordosis": lambda: sagittal[-1] - sagittal[0],
        "apical-rotation": lambda: _twist(R[0]),
        "axial-rotation": lambda: _twist(R[0]),
        "apical-rotation-projected": lambda: np.degrees(np.arctan2(R[0, 1, 0], R[0, 0, 0])),
        "apical-translation": lambda: -c[0, 1],
        "lateral-displacement": lambda: -c[0, 1],
        "coronal-balance": lambda: -(c[0, 1] - c[-1, 1]),
        "angle-3d": lambda: np.degrees(np.arccos(np.clip(z[0] @ z[-1], -1, 1))),
        CIRCULAR: lambda: np.degrees(np.arctan2(z[0, 1] - z[-1, 1], z[0, 0] - z[-1, 0])),
        "ferguson": lambda: _line(c[1] - c[2]) - _line(c[0] - c[1]),
        "coronal-tilt": lambda: coronal[0],
        "sagittal-tilt": lambda: sagittal[0],
    }
    return float(values[definition]())


def difference(definition: str, a: float, b: float) -> float:
    """Return a - b, between -180 and 180 degrees where the measure is an azimuth."""
    return (a - b + 180) % 360 - 180 if definition == CIRCULAR else a - b


def coronal_tilts_deg(poses: SpinePoses) -> Float:
    """Return the coronal tilt of every level, shape (17,), degrees."""
    z = poses.rotation[:, :, 2]
    return np.asarray(np.degrees(np.arctan2(-z[:, 1], z[:, 2])))


def true_ends(poses: SpinePoses, near: Sequence[float]) -> tuple[int, ...]:
    """Return the levels whose coronal tilt is extreme.

    Parameters
    ----------
    poses
        The spine, all ``LEVELS``.
    near
        Places of the end vertebrae in a spine of the same curves, not rounded. Each is searched from the middle of the
        curve above to that of the curve below.
    """
    coronal = coronal_tilts_deg(poses)
    signs = -np.sign(np.diff(np.interp(near, np.arange(len(LEVELS)), coronal)))
    signs = np.append(signs, -signs[-1])
    middles = [(a + b) / 2 for a, b in pairwise(near)]
    bounds = [0, *(round(middle) for middle in middles), len(LEVELS) - 1]
    found = []
    for first, last, sign in zip(bounds[:-1], bounds[1:], signs, strict=True):
        rows = np.arange(first, last + 1)
        found.append(int(rows[np.argmax(sign * coronal[rows])]))
    return tuple(found)


def true_reselected(poses: SpinePoses, curves: Sequence[Curve], name: str) -> float:
    """Return the Cobb angle at the most tilted vertebrae of a curve, from the apex above to the apex below, degrees.

    The curve is convex to the side to which it is between its end vertebrae of the baseline.
    """
    coronal = coronal_tilts_deg(poses)
    apices = [
        LEVELS.index(curve.upper) + 0.5 if curve.apex is None else LEVELS.index(curve.apex)
        for curve in curves
    ]
    bounds = [0, *apices, len(LEVELS) - 1]
    number = [curve.name for curve in curves].index(name)
    above, apex, below = bounds[number : number + 3]
    level, curve = np.arange(len(LEVELS)), curves[number]
    upper, lower = coronal[(above <= level) & (level < apex)], coronal[(apex < level) & (level <= below)]
    if coronal[LEVELS.index(curve.lower)] >= coronal[LEVELS.index(curve.upper)]:
        return float(np.max(lower) - np.min(upper))
    return float(np.min(lower) - np.max(upper))


def _twist(R: Float) -> float:
    """Return the rotation about z that is left when z is turned back to Z along the shortest way, degrees."""
    axis = np.array([R[1, 2], -R[0, 2], 0.0])
    sine, cosine = float(np.linalg.norm(axis)), float(R[2, 2])
    back = np.eye(3)
    if sine > 0:
        u = axis / sine
        K = np.array([[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]])
        back = np.eye(3) + sine * K + (1 - cosine) * K @ K
    twist = back @ R
    return float(np.degrees(np.arctan2(twist[1, 0], twist[0, 0])))


def _line(line: Float) -> float:
    return float(np.degrees(np.arctan2(-line[1], line[2])))
